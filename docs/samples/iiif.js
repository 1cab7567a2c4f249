/** Shows each canvas of a IIIF manifest that has a relightable photograph. */

const main = document.querySelector('main');
const address = new URL(main.dataset.manifest, document.baseURI);
const manifest = await (await fetch(address)).json();

for (const canvas of manifest.items) {
  const image = bodies(canvas.items).find(({ type }) => type === 'Image');
  const relightable = bodies(canvas.annotations).find(
    ({ format }) => format === 'application/vnd.ltm',
  );
  if (!relightable) continue;
  const photo = document.createElement('relightable-photo');
  photo.src = new URL(relightable.id, address).href;
  if (image) photo.poster = new URL(image.id, address).href;
  photo.alt = textOf(canvas.summary ?? manifest.summary ?? canvas.label ?? manifest.label);
  photo.light = 'torch';
  photo.lightSize = 0.25;
  photo.exposure = 1.5;
  photo.controls = true;
  photo.width = canvas.width;
  photo.height = canvas.height;
  const title = document.createElement('h1');
  title.textContent = textOf(canvas.label ?? manifest.label);
  const credit = document.createElement('p');
  credit.textContent = textOf(manifest.requiredStatement?.value);
  main.append(title, photo, credit);
}

/** The bodies of all annotations on some annotation pages. */
function bodies(pages = []) {
  return pages.flatMap(({ items = [] }) => items).flatMap(({ body }) => body);
}

/** A text in the page's language, or in the first language that it has. */
function textOf(text = {}) {
  return (text[document.documentElement.lang] ?? Object.values(text)[0] ?? []).join(' ');
}
