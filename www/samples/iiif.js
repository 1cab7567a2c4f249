/** Shows every canvas of a IIIF manifest that has a relightable photograph. */

const main = document.querySelector('main');
const address = new URL(main.dataset.manifest, document.baseURI);
const manifest = await (await fetch(address)).json();

for (const canvas of manifest.items) {
  const still = bodies(canvas.items).find(({ type }) => type === 'Image');
  const relightable = bodies(canvas.annotations).find(
    ({ format }) => format === 'application/vnd.ltm',
  );
  if (!relightable) continue;
  const photo = document.createElement('relightable-photo');
  photo.src = new URL(relightable.id, address).href;
  if (still) photo.poster = new URL(still.id, address).href;
  photo.alt = words(canvas.summary ?? manifest.summary ?? canvas.label ?? manifest.label);
  photo.light = 'torch';
  photo.controls = true;
  photo.style.setProperty('--relightable-photo-aspect', `${canvas.width} / ${canvas.height}`);
  const title = document.createElement('h1');
  title.textContent = words(canvas.label ?? manifest.label);
  const credit = document.createElement('p');
  credit.textContent = words(manifest.requiredStatement?.value);
  main.append(title, photo, credit);
}

/** What the annotations of some pages show. */
function bodies(pages = []) {
  return pages.flatMap(({ items = [] }) => items).flatMap(({ body }) => body);
}

/** A text in the page's language, or in the first there is. */
function words(text = {}) {
  return (text[document.documentElement.lang] ?? Object.values(text)[0] ?? []).join(' ');
}
