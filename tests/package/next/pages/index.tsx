import 'relightable-photo';
import type {} from 'relightable-photo/react';
import type { RelightablePhoto } from 'relightable-photo';
import { useRef, useState } from 'react';

export default function Page() {
  const photo = useRef<RelightablePhoto>(null);
  const [backend, setBackend] = useState('');
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
        onbackendchange={(event) => setBackend(event.backend)}
        onload={() => photo.current?.setAttribute('data-loaded', '')}
      />
      <output>{backend}</output>
    </main>
  );
}
