/** What the element says to visitors. English is at hand; other languages are fetched where they are needed. */

/** English, and those that there are translations to, in their order there. */
export const LANGUAGES = ['en', 'fr', 'de', 'it', 'es', 'ja', 'zh'] as const;

export type Language = (typeof LANGUAGES)[number];

export const ENGLISH = {
  light: 'Light',
  slider: '2D slider',
  picture: 'Picture',
  controls: 'Controls',
  loading: 'Loading the picture',
  loaded: 'The picture is ready.',
  broken: 'The picture cannot be shown.',
  flawed: 'Something here does not work as intended.',
  details: 'Details',
  flood: 'Flood',
  torch: 'Torch',
  checkerboard: 'Checkerboard',
  stripes: 'Stripes',
  spectrum: 'Spectrum',
  fire: 'Fire',
  projection: 'Projection',
  play: 'Play',
  pause: 'Pause',
  zoomIn: 'Zoom in',
  zoomOut: 'Zoom out',
  reset: 'Reset',
  tilt: 'Light by tilting',
  fullscreen: 'Full screen',
  leaveFullscreen: 'Leave full screen',
  reveal: 'Light it yourself',
  // Ctrl or ⌘ comes in the place of {0}.
  wheelHint: '{0} + scroll to zoom',
  touchHint: 'Use two fingers to zoom and move',
  zoomed: 'Zoom {0}×',
  // A place, near or far, and how far across and down.
  lightAt: 'Light from {0}, {1}, {2}',
  lightInMiddle: 'Light in the middle',
  near: 'near',
  far: 'far',
  upperLeft: 'upper left',
  above: 'above',
  upperRight: 'upper right',
  left: 'left',
  right: 'right',
  lowerLeft: 'lower left',
  below: 'below',
  lowerRight: 'lower right',
} as const;

/** The name of a text. */
export type Word = keyof typeof ENGLISH;

type Translated = Readonly<Record<Word, readonly string[]>>;

let translated: Translated | null = null;
let fetching: Promise<void> | null = null;
let fetched = false;

/** Fetches translations, once a page. Settles when they are there, or cannot be had, which leaves English. */
export function fetchTranslations(): Promise<void> {
  fetching ??= import('./translations.js')
    .then(({ TRANSLATIONS }) => {
      translated = TRANSLATIONS;
    })
    .catch(() => {})
    .then(() => {
      fetched = true;
    });
  return fetching;
}

/** Whether a language is to be fetched yet. */
export function isMissing(language: Language): boolean {
  return language !== 'en' && !fetched;
}

/** A text in a language, or in English until that is there, with what comes in the places of {0}, {1}… */
export function say(word: Word, language: Language, ...values: readonly string[]): string {
  const text = translated?.[word][LANGUAGES.indexOf(language) - 1] ?? ENGLISH[word];
  return text.replace(/\{(\d)\}/g, (_, index: string) => values[Number(index)] ?? '');
}

/** The first of some BCP 47 tags that there are texts in; English where there is none. */
export function languageOf(tags: readonly string[]): Language {
  for (const tag of tags) {
    const primary = tag.trim().toLowerCase().split(/[-_]/, 1)[0];
    const known = LANGUAGES.find((language) => language === primary);
    if (known) return known;
  }
  return 'en';
}
