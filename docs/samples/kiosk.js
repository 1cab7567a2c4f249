/** Loads the photograph again one minute after an error, because nobody attends a kiosk. */

const RETRY_MS = 60_000;

const photo = document.querySelector('relightable-photo');
let retryTimer = 0;
photo.addEventListener('error', ({ code, message }) => {
  console.warn(code, message);
  clearTimeout(retryTimer);
  retryTimer = setTimeout(() => photo.load(), RETRY_MS);
});
photo.addEventListener('load', () => clearTimeout(retryTimer));
document.addEventListener('contextmenu', (event) => event.preventDefault());
