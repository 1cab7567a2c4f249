/**
 * The gallery. What its first picture shows can be read from and set by its address: ?light=…&backend=…
 *
 * @typedef {import('../src/index.js').RelightablePhoto} RelightablePhoto
 */

const TITLES = /** @type {const} */ ({ webgpu: 'WebGPU', webgl2: 'WebGL2', cpu: 'CPU' });

const photo = /** @type {RelightablePhoto} */ (document.getElementById('photo'));
const form = /** @type {HTMLFormElement} */ (document.getElementById('controls'));
const backend = /** @type {HTMLSelectElement} */ (document.getElementById('backend'));
const status = /** @type {HTMLOutputElement} */ (document.getElementById('status'));
const file = /** @type {HTMLInputElement} */ (document.getElementById('file'));
const camera = /** @type {HTMLButtonElement} */ (document.getElementById('camera'));
const play = /** @type {HTMLButtonElement} */ (document.getElementById('play'));
const hint = /** @type {HTMLElement} */ (document.getElementById('hint'));

const lights = /** @type {NodeListOf<HTMLInputElement>} */ (
  form.querySelectorAll('input[name="light"]')
);

/** Why the back end is not the first choice. */
let reason = '';
/** Puts away what the visitor has lit the picture by. */
let putAway = () => {};
/** Counts what the visitor has asked for: what comes late gives way to what was asked for later. */
let wishes = 0;

const asked = new URLSearchParams(location.search);
const light = asked.get('light');
for (const input of lights) if (input.value === light) input.checked = true;
backend.value = asked.get('backend') ?? '';
if (backend.selectedIndex < 0) backend.value = '';
apply();

// The menu belongs to the form but stands outside of it.
document.addEventListener('change', ({ target }) => {
  if (target === file) return;
  if (target !== backend) shine(null);
  apply();
  const state = new URLSearchParams({ light: photo.light });
  if (backend.value) state.set('backend', backend.value);
  history.replaceState(null, '', `?${state}`);
});

photo.addEventListener('backendchange', (event) => {
  reason = event.reason;
  tell();
});
photo.addEventListener('load', tell);
photo.addEventListener('error', ({ code }) => {
  // The element shows the message itself, and goes on drawing by another light where only that is wrong.
  if (!code.startsWith('light-')) status.textContent = 'Not drawn.';
});
if (photo.info) tell();

file.addEventListener('change', async () => {
  const chosen = file.files?.[0];
  if (!chosen) return;
  wishes += 1;
  const wish = wishes;
  try {
    if (chosen.type.startsWith('video/')) {
      await showFilm(chosen, wish);
    } else {
      const bitmap = await createImageBitmap(chosen);
      if (wish === wishes) shine(bitmap, file, () => bitmap.close());
      else bitmap.close();
    }
  } catch {
    status.textContent = `This browser cannot show ${chosen.name}.`;
  }
  // The same file may be chosen again.
  file.value = '';
});

// Fire is still to begin with for who asks for less motion.
play.addEventListener('click', () => {
  photo.paused = !photo.paused;
  tellPlay();
});
matchMedia('(prefers-reduced-motion: reduce)').addEventListener('change', tellPlay);
// Not before: `paused` is the element's own word.
customElements.whenDefined('relightable-photo').then(tellPlay);

const cameras = navigator.mediaDevices;
/** @type {HTMLElement} */ (document.getElementById('with-camera')).hidden = !cameras;
camera.addEventListener('click', async () => {
  wishes += 1;
  const wish = wishes;
  try {
    const stream = await cameras.getUserMedia({ video: { width: 640 } });
    const stop = () => {
      for (const track of stream.getTracks()) track.stop();
    };
    if (wish === wishes) shine(stream, camera, stop);
    else stop();
  } catch (error) {
    const name = error instanceof DOMException ? error.name : '';
    status.textContent =
      {
        NotAllowedError:
          'The camera may not be used: allow it in the browser’s settings for this page.',
        NotFoundError: 'There is no camera.',
        NotReadableError: 'Another program has the camera: close that, and try again.',
      }[name] ?? 'The camera could not be used.';
  }
});

/**
 * @param {File} chosen
 * @param {number} wish
 */
async function showFilm(chosen, wish) {
  const src = URL.createObjectURL(chosen);
  const film = Object.assign(document.createElement('video'), {
    src,
    muted: true,
    loop: true,
    playsInline: true,
  });
  const stop = () => {
    film.pause();
    film.removeAttribute('src');
    film.load();
    URL.revokeObjectURL(src);
  };
  try {
    await film.play();
  } catch (error) {
    stop();
    throw error;
  }
  if (wish === wishes) shine(film, file, stop);
  else stop();
}

/**
 * Lights the picture by something of the visitor's, or by the built-in lights again.
 *
 * @param {import('../src/index.js').LightSource | null} source
 * @param {HTMLElement} [control] by which it was chosen
 * @param {() => void} [stop]
 */
function shine(source, control, stop = () => {}) {
  wishes += 1;
  photo.lightSource = source;
  putAway();
  putAway = stop;
  file.nextElementSibling?.classList.toggle('lit', control === file);
  camera.setAttribute('aria-pressed', String(control === camera));
  if (!source) return;
  for (const input of lights) input.checked = false;
  hint.classList.add('off');
  tellPlay();
  tell();
}

function apply() {
  // None is while something of the visitor's shines.
  const chosen = [...lights].find((input) => input.checked)?.value ?? photo.light;
  if (photo.getAttribute('light') !== chosen) photo.setAttribute('light', chosen);
  tellPlay();
  // A hidden line is not read out either.
  hint.classList.toggle('off', chosen !== 'torch' || photo.lightSource !== null);
  if ((photo.getAttribute('backend') ?? '') === backend.value) return;
  if (backend.value) photo.setAttribute('backend', backend.value);
  else photo.removeAttribute('backend');
}

function tell() {
  const { info, activeBackend, kernel } = photo;
  if (!info || !activeBackend) return;
  const parts = [
    `${TITLES[activeBackend]}${kernel ? ` (${kernel})` : ''}`,
    `${info.width} × ${info.height} pixels`,
    `${info.lightWidth} × ${info.lightHeight} lights`,
  ];
  status.textContent = [parts.join(' · '), reason].filter(Boolean).join('. ');
}

function tellPlay() {
  play.hidden = photo.light !== 'fire' || photo.lightSource != null || !photo.matches(':defined');
  play.textContent = photo.paused ? 'Let the fire burn.' : 'Hold the fire still.';
}
