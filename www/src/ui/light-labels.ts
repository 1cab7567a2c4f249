/** Where a light is, in words. */

import { type Language, say, type Word } from '../i18n/strings.js';
import type { PicturePoint } from '../shared/values.js';

const PLACES: readonly (readonly Word[])[] = [
  ['upperLeft', 'above', 'upperRight'],
  ['left', 'lightInMiddle', 'right'],
  ['lowerLeft', 'below', 'lowerRight'],
];

/** Of the picture, to either side of its middle: within, light is in the middle. */
const MIDDLE = 1 / 8;
/** From the middle, of the picture. */
const NEAR = 0.3;

/** Such as “Light from upper left, near, 35 % · 30 %”, the last of them across and down. */
export function lightWords({ x, y }: PicturePoint, language: Language): string {
  const word = PLACES[third(y)]?.[third(x)] ?? 'lightInMiddle';
  const percent = (part: number) => `${Math.round(100 * part)} %`;
  const numbers = `${percent(x)} · ${percent(y)}`;
  if (word === 'lightInMiddle') return `${say(word, language)}, ${numbers}`;
  const far = say(Math.hypot(x - 0.5, y - 0.5) < NEAR ? 'near' : 'far', language);
  return say('lightAt', language, say(word, language), far, numbers);
}

function third(part: number): number {
  if (part < 0.5 - MIDDLE) return 0;
  return part > 0.5 + MIDDLE ? 2 : 1;
}
