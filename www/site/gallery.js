/**
 * The gallery's first picture: its controls, and its state in the page's address, ?light=…&backend=…
 *
 * @typedef {import('../src/index.js').RelightablePhotoElement} RelightablePhotoElement
 * @typedef {import('../src/index.js').LightSource} LightSource
 */

const BACKEND_NAMES = /** @type {const} */ ({ webgpu: 'WebGPU', webgl2: 'WebGL2', cpu: 'CPU' });

const photo = /** @type {RelightablePhotoElement} */ (document.getElementById('photo'));
const form = /** @type {HTMLFormElement} */ (document.getElementById('controls'));
const backend = /** @type {HTMLSelectElement} */ (document.getElementById('backend'));
const status = /** @type {HTMLOutputElement} */ (document.getElementById('status'));
const file = /** @type {HTMLInputElement} */ (document.getElementById('file'));
const camera = /** @type {HTMLButtonElement} */ (document.getElementById('camera'));
const play = /** @type {HTMLButtonElement} */ (document.getElementById('play'));
const message = /** @type {HTMLOutputElement} */ (document.getElementById('message'));
const hint = /** @type {HTMLElement} */ (document.getElementById('hint'));

const lights = /** @type {NodeListOf<HTMLInputElement>} */ (
  form.querySelectorAll('input[name="light"]')
);

/** A torch and a fire light a part of the window only: the page exposes longer, as a camera would. */
const SETTINGS = /** @type {Record<string, Record<string, string>>} */ ({
  torch: { exposure: '2', 'light-size': '0.17' },
  fire: { exposure: '1.5' },
});
/** How long the window is shown under flood light before the fire begins. */
const FIRE_DELAY_MS = 5000;

/** Why a preferred backend is not in use. */
let backendReason = '';
/** Whether a source of the visitor lights the photograph. */
let hasSource = false;
/** Releases the visitor's current image, video or camera. */
let releaseSource = () => {};
/** Increases with each choice of the visitor, so that a source that opens late does not replace a newer choice. */
let choiceCount = 0;

const params = new URLSearchParams(location.search);
for (const input of lights) if (input.value === params.get('light')) input.checked = true;
backend.value = params.get('backend') ?? '';
if (backend.selectedIndex < 0) backend.value = '';
applyForm();
if (!params.has('light')) startFireLater();

// The backend menu belongs to the form but is outside of it, so listen on the document.
document.addEventListener('change', ({ target }) => {
  if (target === file) return;
  message.textContent = '';
  if (target !== backend) setSource(null);
  applyForm();
  const state = new URLSearchParams({ light: photo.getAttribute('light') ?? '' });
  if (backend.value) state.set('backend', backend.value);
  history.replaceState(null, '', `?${state}`);
});

photo.addEventListener('backendchange', (event) => {
  backendReason = event.reason;
  updateStatus();
});
photo.addEventListener('load', updateStatus);
// The element shows the message.
photo.addEventListener('error', () => {
  status.textContent = 'Not drawn.';
});
photo.addEventListener('warning', (event) => {
  message.textContent = event.message;
});
if (photo.info) updateStatus();

file.addEventListener('change', async () => {
  const chosen = file.files?.[0];
  if (!chosen) return;
  try {
    await openSource(file, () =>
      chosen.type.startsWith('video/') ? openVideo(chosen) : openImage(chosen),
    );
  } catch {
    message.textContent = `This browser cannot show ${chosen.name}.`;
  }
  // Allows the visitor to choose the same file again.
  file.value = '';
});

// Under prefers-reduced-motion the fire is paused at first.
play.addEventListener('click', () => {
  if (photo.paused) photo.play();
  else photo.pause();
  updatePlayButton();
});
matchMedia('(prefers-reduced-motion: reduce)').addEventListener('change', updatePlayButton);
// `paused` exists only once the element is defined.
customElements.whenDefined('relightable-photo').then(updatePlayButton);

const { mediaDevices } = navigator;
/** @type {HTMLElement} */ (document.getElementById('with-camera')).hidden = !mediaDevices;
camera.addEventListener('click', async () => {
  try {
    await openSource(camera, openCamera);
  } catch (error) {
    const name = error instanceof DOMException ? error.name : '';
    message.textContent =
      {
        NotAllowedError:
          'The browser blocks the camera. Allow it for this page in the browser’s settings.',
        NotFoundError: 'This device has no camera.',
        NotReadableError: 'Another program uses the camera. Close it and try again.',
      }[name] ?? 'The camera does not work.';
  }
});

/**
 * Opens a source, and lights the photograph with it unless the visitor has chosen another one meanwhile.
 *
 * @param {HTMLElement} control by which the visitor chose it
 * @param {() => Promise<{ source: LightSource, release: () => void }>} open
 */
async function openSource(control, open) {
  choiceCount += 1;
  const choice = choiceCount;
  const { source, release } = await open();
  if (choice === choiceCount) setSource(source, control, release);
  else release();
}

/** @param {File} image */
async function openImage(image) {
  const source = await createImageBitmap(image);
  return { source, release: () => source.close() };
}

async function openCamera() {
  const source = await mediaDevices.getUserMedia({ video: { width: 640 } });
  const release = () => {
    for (const track of source.getTracks()) track.stop();
  };
  return { source, release };
}

/** @param {File} video */
async function openVideo(video) {
  const src = URL.createObjectURL(video);
  const source = Object.assign(document.createElement('video'), {
    src,
    muted: true,
    loop: true,
    playsInline: true,
  });
  const release = () => {
    source.pause();
    source.removeAttribute('src');
    source.load();
    URL.revokeObjectURL(src);
  };
  try {
    await source.play();
  } catch (error) {
    release();
    throw error;
  }
  return { source, release };
}

/**
 * Lights the photograph with a source of the visitor, or with the built-in lights (`null`).
 *
 * @param {LightSource | null} source
 * @param {HTMLElement} [control] by which the visitor chose it
 * @param {() => void} [release]
 */
function setSource(source, control, release = () => {}) {
  choiceCount += 1;
  photo.light = source;
  hasSource = source !== null;
  releaseSource();
  releaseSource = release;
  file.nextElementSibling?.classList.toggle('active', control === file);
  camera.setAttribute('aria-pressed', String(control === camera));
  if (!source) return;
  applySettings();
  for (const input of lights) input.checked = false;
  hint.hidden = true;
  updatePlayButton();
  updateStatus();
}

/** After a look at the window under flood light, a fire begins, unless the visitor has chosen a light. */
function startFireLater() {
  if (matchMedia('(prefers-reduced-motion: reduce)').matches) return;
  const before = choiceCount;
  photo.addEventListener('load', () => setTimeout(start, FIRE_DELAY_MS), { once: true });
  const start = () => {
    if (choiceCount !== before) return;
    for (const input of lights) input.checked = input.value === 'fire';
    applyForm();
  };
}

function applySettings() {
  const settings = hasSource ? {} : (SETTINGS[photo.getAttribute('light') ?? ''] ?? {});
  for (const name of ['exposure', 'light-size']) {
    const value = settings[name];
    if (value === undefined) photo.removeAttribute(name);
    else photo.setAttribute(name, value);
  }
}

function applyForm() {
  // No light is checked while a source of the visitor is in use.
  const light =
    [...lights].find((input) => input.checked)?.value ?? photo.getAttribute('light') ?? 'flood';
  if (photo.getAttribute('light') !== light) photo.setAttribute('light', light);
  updatePlayButton();
  hint.hidden = light !== 'torch' || hasSource;
  applySettings();
  if ((photo.getAttribute('backend') ?? '') === backend.value) return;
  if (backend.value) photo.setAttribute('backend', backend.value);
  else photo.removeAttribute('backend');
}

function updateStatus() {
  const { info, activeBackend, kernel } = photo;
  if (!info || !activeBackend) return;
  const parts = [
    `${BACKEND_NAMES[activeBackend]}${kernel ? ` (${kernel})` : ''}`,
    `${info.width} × ${info.height} pixels`,
    `${info.lightWidth} × ${info.lightHeight} light elements`,
  ];
  status.textContent = [parts.join(' · '), backendReason].filter(Boolean).join('. ');
}

function updatePlayButton() {
  play.hidden = photo.getAttribute('light') !== 'fire' || hasSource || !photo.matches(':defined');
  play.textContent = photo.paused ? 'Play the fire.' : 'Pause the fire.';
}
