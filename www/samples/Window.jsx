'use client';

import { useState } from 'react';
import 'relightable-photo';

export default function Window() {
  const [light, setLight] = useState('torch');
  const [error, setError] = useState('');

  return (
    <figure>
      <relightable-photo
        src="/photos/stained-glass.ltm"
        alt="A rose window of stained glass, lit from behind."
        light={light}
        onload={() => setError('')}
        onerror={(event) => setError(event.code)}
      />
      <button type="button" onClick={() => setLight('fire')}>
        Light a fire behind the window
      </button>
      {error && <figcaption>Error: {error}</figcaption>}
    </figure>
  );
}
