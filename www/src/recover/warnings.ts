/** Messages of the doubts about a recovery, as the command line's. */

import type { InputSummary, PreparationSummary, RecoverySummary } from './protocol.js';
import type { PhotographFaultCode, RecoveryWarning, RecoveryWarningCode } from './types.js';

export function describeWarnings(
  { width, height, shotsUsed, unknownFields }: InputSummary,
  { window, expectedSnr = 0 }: PreparationSummary,
  { warnings, saturatedSamples, overexposedPixels }: RecoverySummary,
): RecoveryWarning[] {
  const samples = 3 * width * height * shotsUsed.length;
  const percent = ((100 * saturatedSamples) / samples).toFixed(1);
  const side = `${window}x${window} light elements`;
  const messages: Record<
    Exclude<RecoveryWarningCode, PhotographFaultCode | 'camera-trembled'>,
    string
  > = {
    'low-snr':
      `The SNR on held-out patterns is only ${expectedSnr.toFixed(1)} dB. Check that the photographs are linear, that ` +
      'the light was steady and that the correspondence is right. With few patterns, or another method than learned, ' +
      'it may not get better.',
    'band-unbounded': `The band is at least as wide as the largest window tried, ${side}; a larger one can be given as window.`,
    'band-undetermined': `The photographs do not show how wide the band is; a window of ${side} is used, another can be given as window.`,
    saturation:
      `${percent} % of the samples are saturated and left out, which is a large share. Check the white level, or ` +
      'photograph with less exposure.',
    overexposed:
      `${overexposedPixels} pixels are saturated in nearly all photographs and will be white under every light. ` +
      'Photograph with less exposure, or add shots with less.',
    'unknown-fields': `Unknown fields of capture.json are ignored: ${unknownFields.join(', ')}.`,
  };
  const given = unknownFields.length > 0 ? ['unknown-fields', ...warnings] : warnings;
  return given.map((warning) => {
    const [code, ...numbers] = warning.split(' ') as [RecoveryWarningCode, ...string[]];
    const texts = { ...messages, ...faultMessages(numbers), ...tremblingMessage(numbers) };
    return { code, message: texts[code] };
  });
}

/**
 * Messages of a photograph that is left out: of a shot, another shot (or the number of moved photographs), and a
 * percentage.
 */
function faultMessages([shot, other, percent]: string[]): Record<PhotographFaultCode, string> {
  const leftOut = `shots[${shot}] is left out: it`;
  const shows = `${leftOut} shows`;
  return {
    'photograph-pattern': `${shows} the pattern of shots[${other}].`,
    'photograph-blend': `${shows} a blend of its pattern and ${percent} % of the pattern of shots[${other}]. Was it taken while the screen changed?`,
    'photograph-unknown-pattern': `${shows} neither its pattern nor any other pattern of this capture.`,
    'photograph-object': `${shows} another object, or this one from another place.`,
    'photograph-moved':
      (other === '1'
        ? `shots[${shot}] is left out`
        : `shots[${shot}] and ${Number(other) - 1} more are left out`) +
      ': the camera or the object had moved by more than a third of a pixel.',
    'photograph-distorted': `${leftOut} differs from its prediction. Is it blurred, or did something cover the object?`,
  };
}

/** The message of a camera that trembled, by hundredths of a pixel. */
function tremblingMessage([hundredths]: string[]): Record<'camera-trembled', string> {
  return {
    'camera-trembled':
      `The camera moved between photographs: pictures are shifted by ${(Number(hundredths) / 100).toFixed(2)} pixels ` +
      '(root mean square). This is corrected, but costs accuracy. Fasten the camera, or wait before each photograph.',
  };
}
