/** Nobody stands beside a kiosk: what cannot be shown is tried again after a minute. */

const MINUTE = 60_000;

const photo = document.querySelector('relightable-photo');
let waiting = 0;
photo.addEventListener('error', ({ code, message }) => {
  console.warn(code, message);
  clearTimeout(waiting);
  waiting = setTimeout(() => photo.setAttribute('src', photo.getAttribute('src')), MINUTE);
});
photo.addEventListener('load', () => clearTimeout(waiting));
document.addEventListener('contextmenu', (event) => event.preventDefault());
