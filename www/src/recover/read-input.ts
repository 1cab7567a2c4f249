/** Has a coordinator read a capture folder, or the pictures of a page, one after another. */

import { DEFAULT_GAMMA, type InputSummary, MAX_CODE, type PicturesHeader } from './protocol.js';
import type { RecoveryClient } from './recovery-client.js';
import { hasCodes, isFile, sizeOf, toSentPicture } from './send-pictures.js';
import type { FolderInput, PicturesInput, RecoverySize } from './types.js';

/** Of every so many patterns of a folder, one is held out. */
const HOLD_OUT_INTERVAL = 10;

type Client = Pick<RecoveryClient, 'call'>;

/** The size of a recovery; `undefined` if the input is at fault, which the coordinator reports. */
export async function sizeOfInput(
  input: PicturesInput | FolderInput,
): Promise<RecoverySize | undefined> {
  if ('folder' in input) return sizeOfFolder(input);
  const [photograph, pattern] = [input.photographs[0], input.patterns[0]];
  if (!photograph || !pattern) return undefined;
  const [camera, light] = await Promise.all([sizeOf(photograph), sizeOf(pattern)]);
  const { length: photographs } = input.photographs;
  return { ...camera, lightWidth: light.width, lightHeight: light.height, photographs };
}

async function sizeOfFolder({ folder, shots }: FolderInput): Promise<RecoverySize | undefined> {
  try {
    const {
      camera,
      light,
      shots: listed,
    } = JSON.parse((await folder.get('capture.json')?.text()) ?? '');
    const held = Math.floor(listed.length / HOLD_OUT_INTERVAL);
    const { width, height } = camera;
    const size = {
      width,
      height,
      lightWidth: light.width,
      lightHeight: light.height,
      photographs: shots ?? listed.length - held,
    };
    return Object.values(size).every(Number.isFinite) ? size : undefined;
  } catch {
    return undefined;
  }
}

/** `onPicture` gets the share of the photographs that are read. */
export function readInput(
  coordinator: Client,
  input: PicturesInput | FolderInput,
  size: RecoverySize | undefined,
  onPicture: (share: number) => void,
): Promise<InputSummary> {
  if (!('folder' in input)) return readPictures(coordinator, input, size, onPicture);
  const onProgress = (shots: number) => onPicture(shots / (size?.photographs ?? shots));
  return coordinator.call('readFolder', [input.folder, input.shots], { onProgress });
}

async function readPictures(
  coordinator: Client,
  input: PicturesInput,
  size: RecoverySize | undefined,
  onPicture: (share: number) => void,
): Promise<InputSummary> {
  const { patterns, photographs, exposures, correspondence, grayCode, dark } = input;
  await coordinator.call('beginPictures', [headerOf(input, size)]);
  if (dark) {
    await coordinator.call('setDark', [await toSentPicture(dark, 'dark')]);
  }
  if (correspondence) await coordinator.call('setCorrespondence', [correspondence]);
  for (const [i, { axis, bit, inverted, photograph }] of (grayCode ?? []).entries()) {
    const sent = await toSentPicture(photograph, `grayCode[${i}].photograph`);
    await coordinator.call('addGrayCode', [axis, bit, inverted, sent]);
  }
  for (const [i, pattern] of patterns.entries()) {
    const photograph = photographs[i] as typeof pattern;
    const [sentPattern, sentPhotograph] = await Promise.all([
      toSentPicture(pattern, `patterns[${i}]`),
      toSentPicture(photograph, `photographs[${i}]`),
    ]);
    await coordinator.call('addShot', [i, sentPattern, sentPhotograph, exposures?.[i] ?? 1]);
    onPicture((i + 1) / patterns.length);
  }
  return coordinator.call('finishPictures', []);
}

function headerOf(input: PicturesInput, size: RecoverySize | undefined): PicturesHeader {
  const { photographs, lightGamma = DEFAULT_GAMMA, black = 0, white = MAX_CODE } = input;
  const { title = '', creator = '', rights = '' } = input;
  const { width = 0, height = 0, lightWidth = 0, lightHeight = 0 } = size ?? {};
  // Values that a page has computed are taken for those of a 16-bit camera.
  const codes = photographs.some(hasCodes)
    ? 255
    : photographs.some(isFile)
      ? white - black
      : MAX_CODE;
  const extent = { width, height, lightWidth, lightHeight };
  return { ...extent, quantum: 1 / codes, lightGamma, black, white, title, creator, rights };
}
