/**
 * The playground: a form of all attributes, the element they make, its HTML and its events. What was
 * chosen is in the page's address.
 *
 * @typedef {import('../src/index.js').RelightablePhoto} RelightablePhoto
 */

/** Of these only the beginning matters: the element is made anew when they change. */
const AT_THE_START = ['loading', 'reveal', 'crossorigin', 'wasm-url'];
const EVENTS = [
  'load',
  'progress',
  'error',
  'lightchange',
  'viewchange',
  'backendchange',
  'qualitychange',
  'contextlost',
];
const DETAILS = [
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
  'share',
];
/** Those before are of no use to anyone, and make the page slow. */
const LOGGED = 200;

const form = /** @type {HTMLFormElement} */ (document.getElementById('attributes'));
const stage = /** @type {HTMLElement} */ (document.getElementById('stage'));
const html = /** @type {HTMLElement} */ (document.getElementById('html'));
const log = /** @type {HTMLElement} */ (document.getElementById('log'));
const copied = /** @type {HTMLElement} */ (document.getElementById('copied'));
const controls = /** @type {(HTMLInputElement | HTMLSelectElement)[]} */ (
  [...form.elements].filter((control) => control.getAttribute('name'))
);

/** @type {RelightablePhoto | null} */
let photo = null;

const initial = chosen();
for (const [name, value] of new URLSearchParams(location.search)) {
  const control = controls.find((control) => control.name === name);
  if (control) fill(control, value);
}
make();

form.addEventListener('change', ({ target }) => {
  const { name } = /** @type {HTMLInputElement} */ (target);
  if (AT_THE_START.includes(name)) make();
  else apply();
});
form.addEventListener('submit', (event) => event.preventDefault());
// The event comes before what it tells of.
form.addEventListener('reset', () => setTimeout(make));
document.getElementById('clear')?.addEventListener('click', () => log.replaceChildren());
document.getElementById('take')?.addEventListener('click', () => {
  const state = /** @type {HTMLElement} */ (document.getElementById('state'));
  state.textContent = photo?.getState() ?? '';
});
document.getElementById('copy')?.addEventListener('click', async () => {
  try {
    await navigator.clipboard.writeText(html.textContent ?? '');
    copied.textContent = 'Copied.';
  } catch {
    // Browsers may forbid it: selected, the keyboard copies it.
    getSelection()?.selectAllChildren(html);
    copied.textContent = 'Selected: copy it with your keyboard.';
  }
});

/** Fills in what an address says; a menu keeps its choice where there is none of that name. */
function fill(
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

/** What the form says now, by name. @returns {Record<string, string>} */
function chosen() {
  return Object.fromEntries(
    controls.map((control) => {
      const box = control instanceof HTMLInputElement && control.type === 'checkbox';
      return [control.name, box ? (control.checked ? '1' : '0') : control.value.trim()];
    }),
  );
}

/** The attributes that come of it; empty ones are left out. @returns {[string, string][]} */
function attributes() {
  return controls.flatMap((control) => {
    if (control instanceof HTMLInputElement && control.type === 'checkbox') {
      return control.checked ? [[control.name, '']] : [];
    }
    const value = control.value.trim();
    return value ? [[control.name, value]] : [];
  });
}

function make() {
  const next = document.createElement('relightable-photo');
  for (const type of EVENTS) next.addEventListener(type, tell);
  photo = next;
  apply();
  stage.replaceChildren(next);
}

function apply() {
  if (!photo) return;
  const wanted = attributes();
  for (const control of controls) {
    if (!wanted.some(([name]) => name === control.name)) photo.removeAttribute(control.name);
  }
  for (const [name, value] of wanted) {
    if (photo.getAttribute(name) !== value) photo.setAttribute(name, value);
  }
  const lines = wanted.map(([name, value]) => (value ? `${name}="${quoted(value)}"` : name));
  html.textContent = `<relightable-photo\n  ${lines.join('\n  ')}\n></relightable-photo>`;
  const others = Object.entries(chosen()).filter(([name, value]) => value !== initial[name]);
  const search = new URLSearchParams(others).toString();
  history.replaceState(null, '', search ? `?${search}` : location.pathname);
}

/** @param {string} value */
function quoted(value) {
  return value.replaceAll('&', '&amp;').replaceAll('"', '&quot;');
}

/** @param {Event} event */
function tell(event) {
  const details = DETAILS.filter((name) => name in event).map((name) => {
    const value = /** @type {any} */ (event)[name];
    return `${name}: ${JSON.stringify(value, (_, v) => (typeof v === 'number' ? +v.toFixed(3) : v))}`;
  });
  const line = document.createElement('li');
  line.textContent = [event.type, details.join(', ')].filter(Boolean).join('  ');
  log.prepend(line);
  while (log.childElementCount > LOGGED) log.lastElementChild?.remove();
}
