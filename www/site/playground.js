/**
 * The playground: a form with all attributes, the resulting element, its HTML and its events. The page's address
 * contains the settings.
 *
 * @typedef {import('../src/index.js').RelightablePhotoElement} RelightablePhotoElement
 */

/** These take effect only when the element starts, so a change creates another element. */
const START_ATTRIBUTES = ['loading', 'reveal', 'crossorigin'];
const EVENTS = [
  'load',
  'progress',
  'error',
  'warning',
  'lightchange',
  'viewchange',
  'backendchange',
  'qualitychange',
  'contextlost',
];
const EVENT_FIELDS = [
  'code',
  'message',
  'loaded',
  'total',
  'light',
  'torch',
  'zoom',
  'x',
  'y',
  'backend',
  'reason',
  'quality',
];
/** More lines would make the page slow. */
const MAX_LOG_LINES = 200;

const form = /** @type {HTMLFormElement} */ (document.getElementById('attributes'));
const preview = /** @type {HTMLElement} */ (document.getElementById('preview'));
const html = /** @type {HTMLElement} */ (document.getElementById('html'));
const log = /** @type {HTMLElement} */ (document.getElementById('log'));
const copied = /** @type {HTMLElement} */ (document.getElementById('copied'));
const controls = /** @type {(HTMLInputElement | HTMLSelectElement)[]} */ (
  [...form.elements].filter((control) => control.getAttribute('name'))
);

/** @type {RelightablePhotoElement | null} */
let photo = null;

const initial = settings();
for (const [name, value] of new URLSearchParams(location.search)) {
  const control = controls.find((control) => control.name === name);
  if (control) setControl(control, value);
}
createPhoto();

form.addEventListener('change', ({ target }) => {
  const { name } = /** @type {HTMLInputElement} */ (target);
  if (START_ATTRIBUTES.includes(name)) createPhoto();
  else applyForm();
});
form.addEventListener('submit', (event) => event.preventDefault());
// The event fires before the form is reset.
form.addEventListener('reset', () => setTimeout(createPhoto));
document.getElementById('clear')?.addEventListener('click', () => log.replaceChildren());
document.getElementById('read-state')?.addEventListener('click', () => {
  const state = /** @type {HTMLElement} */ (document.getElementById('state'));
  state.textContent = photo?.getState() ?? '';
});
document.getElementById('copy')?.addEventListener('click', async () => {
  try {
    await navigator.clipboard.writeText(html.textContent ?? '');
    copied.textContent = 'Copied.';
  } catch {
    // The browser may deny access to the clipboard. Select the text, so that the keyboard can copy it.
    getSelection()?.selectAllChildren(html);
    copied.textContent = 'Selected: copy it with your keyboard.';
  }
});

/** Sets a control to a value of the address; a menu ignores unknown values. */
function setControl(
  /** @type {HTMLInputElement | HTMLSelectElement} */ control,
  /** @type {string} */ value,
) {
  if (control instanceof HTMLInputElement && control.type === 'checkbox') {
    control.checked = value !== '0';
  } else if (control instanceof HTMLSelectElement) {
    const option = [...control.options].find((option) => option.value === value);
    if (option) control.value = value;
  } else {
    control.value = value;
  }
}

/** The values of all controls, by name. @returns {Record<string, string>} */
function settings() {
  return Object.fromEntries(
    controls.map((control) => {
      const isCheckbox = control instanceof HTMLInputElement && control.type === 'checkbox';
      return [control.name, isCheckbox ? (control.checked ? '1' : '0') : control.value.trim()];
    }),
  );
}

/** The attributes, without empty ones. @returns {[string, string][]} */
function attributes() {
  return controls.flatMap((control) => {
    if (control instanceof HTMLInputElement && control.type === 'checkbox') {
      return control.checked ? [[control.name, '']] : [];
    }
    const value = control.value.trim();
    return value ? [[control.name, value]] : [];
  });
}

function createPhoto() {
  const next = document.createElement('relightable-photo');
  for (const type of EVENTS) next.addEventListener(type, logEvent);
  photo = next;
  applyForm();
  preview.replaceChildren(next);
}

function applyForm() {
  if (!photo) return;
  const present = attributes();
  for (const control of controls) {
    if (!present.some(([name]) => name === control.name)) photo.removeAttribute(control.name);
  }
  for (const [name, value] of present) {
    if (photo.getAttribute(name) !== value) photo.setAttribute(name, value);
  }
  const lines = present.map(([name, value]) =>
    value ? `${name}="${escapeAttribute(value)}"` : name,
  );
  html.textContent = `<relightable-photo\n  ${lines.join('\n  ')}\n></relightable-photo>`;
  const changed = Object.entries(settings()).filter(([name, value]) => value !== initial[name]);
  const search = new URLSearchParams(changed).toString();
  history.replaceState(null, '', search ? `?${search}` : location.pathname);
}

/** @param {string} value */
function escapeAttribute(value) {
  return value.replaceAll('&', '&amp;').replaceAll('"', '&quot;');
}

/** @param {Event} event */
function logEvent(event) {
  const fields = EVENT_FIELDS.filter((name) => name in event).map((name) => {
    const value = /** @type {any} */ (event)[name];
    return `${name}: ${JSON.stringify(value, (_, v) => (typeof v === 'number' ? +v.toFixed(3) : v))}`;
  });
  const line = document.createElement('li');
  line.textContent = [event.type, fields.join(', ')].filter(Boolean).join('  ');
  log.prepend(line);
  while (log.childElementCount > MAX_LOG_LINES) log.lastElementChild?.remove();
}
