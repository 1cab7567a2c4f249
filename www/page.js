/**
 * The demo page. What it shows can be read from and set by its address: ?light=…&backend=…
 *
 * @typedef {import('./src/index.js').RelightablePhoto} RelightablePhoto
 */

const TITLES = /** @type {const} */ ({ webgpu: 'WebGPU', webgl2: 'WebGL2', cpu: 'CPU' });

const photo = /** @type {RelightablePhoto} */ (document.getElementById('photo'));
const form = /** @type {HTMLFormElement} */ (document.getElementById('controls'));
const backend = /** @type {HTMLSelectElement} */ (document.getElementById('backend'));
const status = /** @type {HTMLOutputElement} */ (document.getElementById('status'));
const file = /** @type {HTMLInputElement} */ (document.getElementById('file'));
const camera = /** @type {HTMLButtonElement} */ (document.getElementById('camera'));
const hint = /** @type {HTMLElement} */ (document.getElementById('hint'));

const lights = /** @type {NodeListOf<HTMLInputElement>} */ (
  form.querySelectorAll('input[name="light"]')
);

/** Why the back end is not the first choice. */
let reason = '';
/** Puts away what the visitor has lit the picture by. */
let putAway = () => {};

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
  try {
    if (chosen.type.startsWith('video/')) await showFilm(chosen);
    else shine(await createImageBitmap(chosen), file);
  } catch {
    status.textContent = `This browser cannot show ${chosen.name}.`;
  }
  // The same file may be chosen again.
  file.value = '';
});

const cameras = navigator.mediaDevices;
/** @type {HTMLElement} */ (document.getElementById('with-camera')).hidden = !cameras;
camera.addEventListener('click', async () => {
  try {
    const stream = await cameras.getUserMedia({ video: { width: 640 } });
    shine(stream, camera, () => {
      for (const track of stream.getTracks()) track.stop();
    });
  } catch {
    status.textContent = 'The camera could not be used.';
  }
});

/** @param {File} chosen */
async function showFilm(chosen) {
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
  shine(film, file, stop);
}

/**
 * Lights the picture by something of the visitor's, or by the built-in lights again.
 *
 * @param {import('./src/index.js').LightSource | null} source
 * @param {HTMLElement} [control] by which it was chosen
 * @param {() => void} [stop]
 */
function shine(source, control, stop = () => {}) {
  photo.lightSource = source;
  putAway();
  putAway = stop;
  file.nextElementSibling?.classList.toggle('lit', control === file);
  camera.classList.toggle('lit', control === camera);
  if (!source) return;
  for (const input of lights) input.checked = false;
  hint.classList.add('off');
  tell();
}

function apply() {
  // None is while something of the visitor's shines.
  const chosen = [...lights].find((input) => input.checked)?.value ?? photo.light;
  if (photo.getAttribute('light') !== chosen) photo.setAttribute('light', chosen);
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
