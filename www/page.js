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
const hint = /** @type {HTMLElement} */ (document.getElementById('hint'));

const lights = /** @type {NodeListOf<HTMLInputElement>} */ (
  form.querySelectorAll('input[name="light"]')
);

/** Why the back end is not the first choice. */
let reason = '';

const asked = new URLSearchParams(location.search);
const light = asked.get('light');
for (const input of lights) if (input.value === light) input.checked = true;
backend.value = asked.get('backend') ?? '';
if (backend.selectedIndex < 0) backend.value = '';
apply();

// The menu belongs to the form but stands outside of it.
document.addEventListener('change', () => {
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
photo.addEventListener('error', () => {
  // The element shows the message itself.
  status.textContent = 'Not drawn.';
});
if (photo.info) tell();

function apply() {
  const chosen = [...lights].find((input) => input.checked)?.value ?? 'flood';
  if (photo.getAttribute('light') !== chosen) photo.setAttribute('light', chosen);
  // A hidden line is not read out either.
  hint.classList.toggle('off', chosen !== 'torch');
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
