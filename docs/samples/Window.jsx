'use client';

import { useEffect, useRef, useState } from 'react';
import 'relightable-photo';

export default function Window({ src = '/photos/window.ltm' }) {
  const photo = useRef(null);
  const [light, setLight] = useState('torch');
  const [message, setMessage] = useState('');

  // React attaches no listeners to custom elements that a server has rendered.
  useEffect(() => {
    const element = photo.current;
    const update = () => setMessage(element.error?.message ?? '');
    element.addEventListener('load', update);
    element.addEventListener('error', update);
    // The photograph may have failed before this effect runs.
    update();
    return () => {
      element.removeEventListener('load', update);
      element.removeEventListener('error', update);
    };
  }, []);

  return (
    <figure>
      <relightable-photo
        ref={photo}
        src={src}
        alt="A rose window of stained glass, lit from behind."
        width="512"
        height="512"
        light={light}
      />
      <button type="button" onClick={() => setLight('fire')}>
        Light a fire behind the window
      </button>
      {message && <figcaption>{message}</figcaption>}
    </figure>
  );
}
