import 'relightable-photo';
import { useEffect, useRef, useState } from 'react';
import type { BackendChangeEvent, RelightablePhotoElement } from 'relightable-photo';
import type {} from 'relightable-photo/react';

export default function Page() {
  const photo = useRef<RelightablePhotoElement>(null);
  const [backend, setBackend] = useState('');
  // React attaches no handlers to custom elements that it hydrates.
  useEffect(() => {
    const changed = (event: BackendChangeEvent) => setBackend(event.backend);
    const element = photo.current;
    element?.addEventListener('backendchange', changed);
    return () => element?.removeEventListener('backendchange', changed);
  }, []);
  return (
    <main>
      <relightable-photo
        ref={photo}
        className="window"
        src="/photos/glass.ltm"
        light="torch"
        backend="cpu"
        exposure={1}
        white-balance="1 1 1"
        alt="A window."
      />
      <output>{backend}</output>
    </main>
  );
}
