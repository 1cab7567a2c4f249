import assert from 'node:assert/strict';
import test from 'node:test';
import type { InputSummary, PreparationSummary, RecoverySummary } from './protocol.js';
import { describeWarnings } from './warnings.js';

const INPUT: InputSummary = {
  width: 10,
  height: 10,
  correspondence: [
    [1, 0, 0],
    [0, 1, 0],
  ],
  shotsUsed: [0, 1],
  unknownFields: [],
};
const PREPARATION: PreparationSummary = {
  tiles: 1,
  tileColumns: 1,
  window: 15,
  rank: undefined,
  expectedSnr: 12.34,
};

function describe(warnings: readonly string[], input: Partial<InputSummary> = {}) {
  const summary: RecoverySummary = {
    lightWidth: 10,
    lightHeight: 10,
    saturatedSamples: 60,
    overexposedPixels: 3,
    warnings,
  };
  return describeWarnings({ ...INPUT, ...input }, PREPARATION, summary);
}

test('each photograph that is left out has a warning of its own, which names its shot', () => {
  const warnings = describe([
    'photograph-pattern 3 7',
    'photograph-blend 17 18 50',
    'photograph-unknown-pattern 20',
    'photograph-object 21',
    'photograph-distorted 22',
    'photograph-distorted 23',
    'photograph-moved 30 1',
    'photograph-moved 30 25',
    'camera-trembled 12',
  ]);
  assert.deepEqual(
    warnings.map(({ code, message }) => [code, message]),
    [
      ['photograph-pattern', 'shots[3] is left out: it shows the pattern of shots[7].'],
      [
        'photograph-blend',
        'shots[17] is left out: it shows a blend of its pattern and 50 % of the pattern of shots[18]. ' +
          'Was it taken while the screen changed?',
      ],
      [
        'photograph-unknown-pattern',
        'shots[20] is left out: it shows neither its pattern nor any other pattern of this capture.',
      ],
      [
        'photograph-object',
        'shots[21] is left out: it shows another object, or this one from another place.',
      ],
      ...[22, 23].map((shot) => [
        'photograph-distorted',
        `shots[${shot}] is left out: it differs from its prediction. Is it blurred, or did ` +
          'something cover the object?',
      ]),
      ...['shots[30] is', 'shots[30] and 24 more are'].map((subject) => [
        'photograph-moved',
        `${subject} left out: the camera or the object had moved by more than a third of a pixel.`,
      ]),
      [
        'camera-trembled',
        'The camera moved between photographs: pictures are shifted by 0.12 pixels (root mean square). ' +
          'This is corrected, but costs accuracy. Fasten the camera, or wait before each photograph.',
      ],
    ],
  );
});

test('other doubts have numbers of the recovery; unknown fields come first', () => {
  const [unknown, saturation, snr] = describe(['saturation', 'low-snr'], {
    unknownFields: ['a', 'b'],
  });
  assert.match(unknown?.message ?? '', /ignored: a, b\.$/);
  assert.match(saturation?.message ?? '', /^10\.0 % of the samples/);
  assert.match(snr?.message ?? '', /only 12\.3 dB/);
});
