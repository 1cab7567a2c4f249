'use client';

import { useState } from 'react';
import 'relightable-photo';

export default function Window() {
  const [light, setLight] = useState('torch');
  const [fault, setFault] = useState('');

  return (
    <figure>
      <relightable-photo
        src="/photos/stained-glass.ltm"
        alt="A rose window of stained glass, lit from behind."
        light={light}
        onload={() => setFault('')}
        onerror={(event) => setFault(event.code)}
      />
      <button type="button" onClick={() => setLight('fire')}>
        Light a fire behind it
      </button>
      {fault && <figcaption>What went wrong: {fault}</figcaption>}
    </figure>
  );
}
