'use client';

import { useEffect, useRef, useState } from 'react';
import 'relightable-photo';

export default function Window() {
  const photo = useRef(null);
  const [light, setLight] = useState('torch');
  const [error, setError] = useState(null);

  // React adds no event handlers to elements that a server has rendered.
  useEffect(() => {
    const element = photo.current;
    const update = () => setError(element.error);
    update();
    for (const type of ['load', 'error']) element.addEventListener(type, update);
    return () => {
      for (const type of ['load', 'error']) element.removeEventListener(type, update);
    };
  }, []);

  return (
    <figure>
      <relightable-photo
        ref={photo}
        src="/photos/stained-glass.ltm"
        alt="A rose window of stained glass, lit from behind."
        light={light}
      />
      <button type="button" onClick={() => setLight('fire')}>
        Light a fire behind the window
      </button>
      {error && <figcaption>Error: {error.code}</figcaption>}
    </figure>
  );
}
