/** Recovery in a page: the same file as the command line's, its errors, and its workers. */

import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { expect, note, test } from './fixtures.js';
import { capturePicture, mountPhoto, waitForEvents, waitForLoad } from './page-helpers.js';
import { FIXTURE, prepareRecovery, recoverFixture, zipFixture } from './recovery-page.js';
import { contentHash, glassBytes, nativePicture } from './test-photos.js';

/** @typedef {import('@playwright/test').Page} Page */

const WASM = join(import.meta.dirname, '../../dist/wasm');
/** Longest task of the main thread. */
const LONG_TASK_MS = 50;

/** Recovery workers of a page. @param {Page} page */
const recoveryWorkers = (page) =>
  page.workers().filter((worker) => worker.url().endsWith('/relightable-photo-recovery.js'));
/** @param {Page} page @param {number} count */
const waitForWorkers = (page, count) => expect.poll(() => recoveryWorkers(page).length).toBe(count);

/** @param {import('./fixtures.js').OpenPage} openPage @param {string} [path] */
async function openRecovery(openPage, path = '/plain') {
  const page = await openPage(path);
  await prepareRecovery(page);
  return page;
}

test('a folder is recovered to the file that the command line writes, without long tasks', async ({
  openPage,
  step,
}) => {
  const page = await openRecovery(openPage, '/trusted-types/monitored');
  /** @type {number[]} */
  let longTasks = [];
  let result = await recoverObserved();
  // A busy machine may hold the page up once; its own work would do so each time.
  for (let i = 0; i < 2 && longTasks.length > 0; i += 1) {
    await page.evaluate('recovered.free()');
    result = await recoverObserved();
  }
  async function recoverObserved() {
    await page.evaluate(() => {
      const tasks = /** @type {number[]} */ ([]);
      const observer = new PerformanceObserver((list) => {
        for (const { duration } of list.getEntries()) tasks.push(duration);
      });
      observer.observe({ type: 'longtask' });
      Object.assign(globalThis, { tasks, observer });
    });
    const observed = await recoverFixture(page);
    longTasks = await page.evaluate(() => {
      const { tasks, observer } = /** @type {any} */ (globalThis);
      observer.disconnect();
      return tasks;
    });
    return observed;
  }
  const { file, reports, seconds, expectedSnr, heldOutSnr, warnings } = result;
  note(`${seconds.toFixed(2)} s, expected ${expectedSnr} dB, held out ${heldOutSnr} dB`);

  await step('the bytes are the same, but for the origin', () => {
    expect(contentHash(file)).toBe(contentHash(glassBytes()));
  });
  await step(`no task is longer than ${LONG_TASK_MS} ms`, () => expect(longTasks).toEqual([]));
  await step('held-out photographs are predicted', () => {
    expect(heldOutSnr).toBeGreaterThan(20);
    expect(Math.abs(heldOutSnr - (expectedSnr ?? 0))).toBeLessThan(10);
    expect(warnings).toEqual([]);
  });
  await step('progress rises through all stages', () => {
    const stages = [...new Set(reports.map(({ stage }) => stage))];
    expect(stages).toEqual(['reading', 'preparing', 'recovering']);
    const fractions = reports.map(({ fraction }) => fraction);
    expect(fractions).toEqual([...fractions].sort((a, b) => a - b));
    expect(fractions.at(-1)).toBe(1);
  });
  await step('only the coordinator lives on, until the photograph is freed', async () => {
    await waitForWorkers(page, 1);
    await page.evaluate('recovered.free()');
    await waitForWorkers(page, 0);
  });
});

test('the result answers questions; elements show it, and return to their files', async ({
  openPage,
  step,
}) => {
  test.slow();
  const page = await openRecovery(openPage);
  await recoverFixture(page);
  await step('a picture is the sum of point scattering functions', async () => {
    const difference = await page.evaluate(async () => {
      const { recovered } = /** @type {any} */ (globalThis);
      const { lightWidth, lightHeight } = recovered;
      const light = new Float32Array(3 * lightWidth * lightHeight);
      const sum = new Float64Array(3 * recovered.width * recovered.height);
      for (const [u, v] of /** @type {const} */ ([
        [3, 4],
        [17, 30],
      ])) {
        light.fill(1, 3 * (v * lightWidth + u), 3 * (v * lightWidth + u) + 3);
        const psf = await recovered.pointScatteringFunction(u, v);
        for (const [i, value] of psf.entries()) sum[i] = (sum[i] ?? 0) + value;
      }
      const picture = /** @type {Float32Array} */ (await recovered.relight(light));
      return Math.max(...picture.map((value, i) => Math.abs(value - (sum[i] ?? 0))));
    });
    expect(difference).toBeLessThan(1e-6);
  });
  await step(
    'a light transport function has the values of the point scattering functions',
    async () => {
      const pairs = await page.evaluate(async () => {
        const { recovered } = /** @type {any} */ (globalThis);
        const [x, y, slot] = [20, 37, 7];
        const { origin, values } = await recovered.transportFunction(x, y);
        const [u, v] = [origin[0] + slot, origin[1] + slot];
        const psf = await recovered.pointScatteringFunction(u, v);
        const n = 3 * (y * recovered.width + x);
        const s = 3 * (slot * recovered.window + slot);
        return [psf.slice(n, n + 3), values.slice(s, s + 3)].map((rgb) => [...rgb]);
      });
      for (const [i, value] of pairs[0]?.entries() ?? [])
        expect(value).toBeCloseTo(pairs[1]?.[i] ?? 0, 5);
    },
  );
  await step('tiles have the light transport functions of all pixels', async () => {
    const { pixels, pairs } = await page.evaluate(async () => {
      const { recovered } = /** @type {any} */ (globalThis);
      const area = 3 * recovered.window ** 2;
      let pixels = 0;
      const pairs = [];
      for (let index = 0; ; index += 1) {
        const tile = await recovered.tileFunctions(index);
        if (!tile) return { pixels, pairs };
        pixels += tile.values.length / area;
        const last = tile.width * tile.height - 1;
        const own = await recovered.transportFunction(
          tile.x + tile.width - 1,
          tile.y + tile.height - 1,
        );
        pairs.push([[...tile.values.slice(last * area)], [...own.values]]);
      }
    });
    expect(pixels).toBe(64 * 64);
    for (const [tile, own] of pairs) expect(tile).toStrictEqual(own);
  });
  await step('photographs are compared with the pictures under their patterns', async () => {
    const snr = await page.evaluate(async () => {
      const { recovered, folder } = /** @type {any} */ (globalThis);
      const pair = (/** @type {string} */ name) => ({
        light: folder.get(`patterns/${name}.png`),
        photograph: folder.get(`photos/${name}.png`),
      });
      return recovered.evaluate([pair('0000'), pair('0001')]);
    });
    // Without black level and dark frame, which a folder's pairs do not have.
    expect(snr).toBeGreaterThan(10);
  });
  await step('another quality makes another file', async () => {
    const [small, large, lossless] = await page.evaluate(async () => {
      const { recovered } = /** @type {any} */ (globalThis);
      const sizes = [];
      for (const quality of [{ maxBytes: 20_000 }, { snr: 35 }, 'lossless']) {
        sizes.push((await recovered.toBlob(quality)).size);
      }
      return sizes;
    });
    expect(small).toBeLessThanOrEqual(20_000);
    expect(large).toBeGreaterThan(20_000);
    expect(lossless).toBeGreaterThan(Number(large));
  });
  await mountPhoto(page, { backend: 'cpu', light: 'stripes', src: '/photos/tall.ltm' });
  await waitForLoad(page);
  await page.evaluate(async () => {
    const { photo, recovered } = /** @type {any} */ (globalThis);
    const lossless = await recovered.toBlob('lossless');
    photo.photograph = recovered;
    const other = photo.cloneNode();
    other.photograph = recovered;
    document.body.append(other);
    await Promise.all([photo.ready, other.ready]);
    Object.assign(globalThis, { other, lossless });
  });
  const stripes = await capturePicture(page);
  await step('it has the size of the capture', async () => {
    const info = await page.evaluate('photo.info');
    const { width, height, lightWidth, lightHeight } = /** @type {any} */ (info);
    expect([width, height, lightWidth, lightHeight]).toEqual([64, 64, 32, 32]);
  });
  await step('it stays when the recovery is freed', async () => {
    await page.evaluate('recovered.free()');
    expect(await capturePicture(page, { light: 'flood' })).not.toMatchPicture(stripes, 20);
    expect(await capturePicture(page, { light: 'stripes' })).toMatchPicture(stripes, 0);
  });
  await step('the picture is that of the lossless file', async () => {
    await page.evaluate(async () => {
      const { photo, lossless } = /** @type {any} */ (globalThis);
      photo.src = URL.createObjectURL(lossless);
      await photo.ready;
    });
    expect(await capturePicture(page)).toMatchPicture(stripes, 1);
  });
  await step('setting src, or null, shows the file again', async () => {
    const sizes = await page.evaluate(async () => {
      const { photo, other } = /** @type {any} */ (globalThis);
      photo.src = '/photos/glass.ltm';
      other.photograph = null;
      await Promise.all([photo.ready, other.ready]);
      return [photo.photograph, photo.info.height, other.info.height];
    });
    expect(sizes).toEqual([null, 64, 512]);
    expect(await capturePicture(page, { light: 'flood' })).toMatchPicture(
      nativePicture('flood'),
      1,
    );
  });
  await step('a freed photograph gives an error', async () => {
    await page.evaluate('photo.photograph = recovered');
    const errors = await waitForEvents(page, 'error');
    expect(errors.at(-1)?.['message']).toContain('was freed');
  });
});

test('pictures of a page give the result of the folder with them', async ({ openPage, step }) => {
  const page = await openRecovery(openPage);
  const manifest = JSON.parse(readFileSync(join(FIXTURE, 'capture.json'), 'utf8'));
  const snrs = await page.evaluate(async (manifest) => {
    const { recovery, folder } = /** @type {any} */ (globalThis);
    const shots = manifest.shots.slice(0, 30);
    const settings = { method: 'nnls', window: 5 };
    const recover = async (/** @type {unknown} */ input) => {
      const recovered = await recovery.recover(input, settings, { workers: 2 });
      const { expectedSnr } = recovered;
      const heldOut = await recovered
        .evaluateHeldOut()
        .catch((/** @type {any} */ { code, message }) => `${code}: ${message}`);
      recovered.free();
      return { expectedSnr, heldOut };
    };
    const file = (/** @type {string} */ name) => folder.get(name);
    const { black, white } = manifest.camera;
    const common = {
      lightGamma: manifest.light.gamma,
      black,
      white,
      dark: file(manifest.dark),
      photographs: shots.map((/** @type {any} */ shot) => file(shot.photo)),
      patterns: shots.map((/** @type {any} */ shot) => file(shot.pattern)),
      grayCode: manifest.graycode.map((/** @type {any} */ shot) => ({
        ...shot,
        photograph: file(shot.photo),
      })),
    };
    const bitmaps = await Promise.all(
      common.patterns.map((/** @type {Blob} */ blob) => createImageBitmap(blob)),
    );
    const context = /** @type {OffscreenCanvasRenderingContext2D} */ (
      new OffscreenCanvas(manifest.light.width, manifest.light.height).getContext('2d')
    );
    const codes = bitmaps.map((bitmap) => {
      context.drawImage(bitmap, 0, 0);
      return context.getImageData(0, 0, bitmap.width, bitmap.height);
    });
    const bytes = await Promise.all(
      common.photographs.map(
        async (/** @type {Blob} */ blob) => new Uint8Array(await blob.arrayBuffer()),
      ),
    );
    return [
      await recover({ folder, shots: 30 }),
      await recover(common),
      await recover({ ...common, patterns: bitmaps, photographs: bytes }),
      await recover({ ...common, patterns: codes }),
    ];
  }, manifest);
  await step('as files, bitmaps, bytes and codes', () => {
    const [ofFolder, ...others] = snrs.map(({ expectedSnr }) => expectedSnr);
    expect(ofFolder).toBeGreaterThan(10);
    for (const snr of others) expect(snr).toBe(ofFolder);
  });
  await step('only a folder has photographs that the recovery did not use', () => {
    const [ofFolder, ...others] = snrs.map(({ heldOut }) => heldOut);
    expect(ofFolder).toBeGreaterThan(10);
    for (const message of others) expect(message).toContain('capture.json');
  });
});

test('exchanged photographs are left out, with a warning for each', async ({ openPage }) => {
  const page = await openRecovery(openPage);
  const manifest = JSON.parse(readFileSync(join(FIXTURE, 'capture.json'), 'utf8'));
  const { shots } = manifest;
  [shots[40].photo, shots[41].photo] = [shots[41].photo, shots[40].photo];
  const { warnings, shotsUsed } = await page.evaluate(async (manifest) => {
    const { recovery, folder } = /** @type {any} */ (globalThis);
    const files = new Map(folder).set('capture.json', new Blob([JSON.stringify(manifest)]));
    const settings = { method: 'nnls', window: 5 };
    const recovered = await recovery.recover({ folder: files }, settings, { workers: 2 });
    const { warnings, shotsUsed } = recovered;
    recovered.free();
    return { warnings, shotsUsed };
  }, manifest);
  // Shots that are held out come before, so indices of measurements are others.
  expect(shotsUsed[40]).not.toBe(40);
  expect(warnings).toStrictEqual([
    {
      code: 'photograph-pattern',
      message: 'shots[40] is left out: it shows the pattern of shots[41].',
    },
    {
      code: 'photograph-pattern',
      message: 'shots[41] is left out: it shows the pattern of shots[40].',
    },
  ]);
});

test('8-bit photographs are made linear', async ({ openPage }) => {
  const page = await openRecovery(openPage);
  const { snr, exact } = await page.evaluate(async () => {
    const { recovery } = /** @type {any} */ (globalThis);
    // Each camera pixel shows the light element behind it, at half its brightness.
    const [width, height, count] = [32, 32, 24];
    let state = 1;
    const random = () => {
      state = (state * 16807) % 2147483647;
      return state / 2147483647;
    };
    const toSrgb = (/** @type {number} */ y) =>
      Math.round(255 * (y <= 0.0031308 ? 12.92 * y : 1.055 * y ** (1 / 2.4) - 0.055));
    const patterns = [];
    const photographs = [];
    const linear = [];
    for (let i = 0; i < count; i += 1) {
      const emission = Float32Array.from({ length: width * height }, random);
      const rgb = Float32Array.from(
        { length: 3 * emission.length },
        (_, k) => (emission[Math.floor(k / 3)] ?? 0) / 2,
      );
      const data = new Uint8ClampedArray(4 * emission.length).fill(255);
      for (const [k, value] of rgb.entries()) data[4 * Math.floor(k / 3) + (k % 3)] = toSrgb(value);
      patterns.push({ width, height, data: emission });
      photographs.push(new ImageData(data, width, height));
      linear.push({ width, height, data: rgb });
    }
    const correspondence = [
      [1, 0, 0],
      [0, 1, 0],
    ];
    const settings = { method: 'nnls', window: 3 };
    const snrs = [];
    for (const given of [photographs, linear]) {
      const input = { patterns, photographs: given, correspondence };
      const recovered = await recovery.recover(input, settings, { workers: 2 });
      const light = new Float32Array(3 * width * height).fill(1);
      const truth = { width, height, data: new Float32Array(3 * width * height).fill(0.5) };
      snrs.push(
        await recovered.evaluate([{ light: { width, height, data: light }, photograph: truth }]),
      );
      recovered.free();
    }
    return { snr: snrs[0], exact: snrs[1] };
  });
  note(`8-bit ${snr} dB, linear ${exact} dB`);
  expect(snr).toBeGreaterThan(35);
  expect(exact).toBeGreaterThan(Number(snr));
});

test('a recovery can be cancelled at any stage', async ({ openPage, step }) => {
  const page = await openRecovery(openPage);
  for (const stage of ['reading', 'preparing', 'recovering']) {
    await step(`while ${stage}`, async () => {
      const reason = await page.evaluate(async (stage) => {
        const { recovery, folder } = /** @type {any} */ (globalThis);
        // Only preparing is cancelled while it learns, which takes long.
        const settings = stage === 'preparing' ? {} : { method: 'nnls', window: 5 };
        const controller = new AbortController();
        const onProgress = (/** @type {any} */ report) => {
          if (report.stage === stage) controller.abort(`enough of ${stage}`);
        };
        const options = { workers: 2, signal: controller.signal, onProgress };
        return recovery
          .recover({ folder }, settings, options)
          .catch((/** @type {unknown} */ thrown) => thrown);
      }, stage);
      expect(reason).toBe(`enough of ${stage}`);
      await waitForWorkers(page, 0);
    });
  }
  await step('while encoding, and the photograph stays usable', async () => {
    const { reason, size } = await page.evaluate(async () => {
      const { recovery, folder } = /** @type {any} */ (globalThis);
      const settings = { method: 'nnls', window: 5 };
      const recovered = await recovery.recover({ folder, shots: 30 }, settings, { workers: 2 });
      const controller = new AbortController();
      const onProgress = () => controller.abort('no file');
      const options = { signal: controller.signal, onProgress };
      const reason = await recovered
        .toBlob(undefined, options)
        .catch((/** @type {unknown} */ e) => e);
      const { size } = await recovered.toBlob();
      recovered.free();
      return { reason, size };
    });
    expect(reason).toBe('no file');
    expect(size).toBeGreaterThan(1000);
  });
});

test('nothing is lost when a worker dies', async ({ openPage }) => {
  const page = await openPage('/plain', {
    // The first worker with a task of the method `kill` gets a message that no page sends, and fails.
    before: () => {
      Object.assign(globalThis, { kill: '', killed: [] });
      const send = Worker.prototype.postMessage;
      Worker.prototype.postMessage = function (/** @type {any[]} */ ...args) {
        const scope = /** @type {any} */ (globalThis);
        const method = args[0]?.task?.method;
        if (method !== undefined && method === scope.kill) {
          scope.killed.push(method);
          scope.kill = '';
          send.call(this, { id: 0 });
        }
        send.apply(this, /** @type {any} */ (args));
      };
    },
  });
  await prepareRecovery(page);
  const [killed, ...files] = await page.evaluate(async () => {
    const scope = /** @type {any} */ (globalThis);
    const recover = async (kill = '', workers = 3) => {
      const input = { folder: scope.folder, shots: 30 };
      const settings = { method: 'nnls', window: 5 };
      scope.kill = kill;
      const recovered = await scope.recovery.recover(input, settings, { workers });
      const bytes = new Uint8Array(await (await recovered.toBlob('lossless')).arrayBuffer());
      recovered.free();
      return bytes.join();
    };
    const disturbed = [await recover('prepareWith'), await recover('solveTile')];
    return [scope.killed, await recover('', 1), await recover(), ...disturbed];
  });
  expect(killed).toStrictEqual(['prepareWith', 'solveTile']);
  const [alone] = files;
  expect(files.map((file) => file === alone)).toStrictEqual([true, true, true, true]);
  await waitForWorkers(page, 0);
});

test('faults are named', async ({ openPage, step }) => {
  test.slow();
  const page = await openRecovery(openPage);
  const manifest = JSON.parse(readFileSync(join(FIXTURE, 'capture.json'), 'utf8'));
  /**
   * @param {(files: Map<string, Blob>, manifest: any, png: (width: number, height: number) => Promise<Blob>) => unknown} change
   *   of the folder, in the page
   * @param {object} [settings]
   * @param {object} [options]
   */
  const failOf = (change, settings = {}, options = {}) =>
    page.evaluate(
      async ({ source, manifest, settings, options }) => {
        const { folder, fails } = /** @type {any} */ (globalThis);
        const files = new Map(folder);
        const png = async (/** @type {number} */ width, /** @type {number} */ height) => {
          const canvas = new OffscreenCanvas(width, height);
          canvas.getContext('2d')?.fillRect(0, 0, 1, 1);
          return canvas.convertToBlob();
        };
        const changed = structuredClone(manifest);
        await new Function('files', 'manifest', 'png', `return (${source})(files, manifest, png)`)(
          files,
          changed,
          png,
        );
        if (files.has('capture.json')) {
          files.set('capture.json', new Blob([JSON.stringify(changed)]));
        }
        const { code, message } = await fails({ folder: files }, settings, {
          workers: 1,
          ...options,
        });
        return `${code}: ${message}`;
      },
      { source: String(change), manifest, settings, options },
    );
  /** @type {[name: string, expected: RegExp, change: Parameters<typeof failOf>[0], settings?: object, options?: object][]} */
  const cases = [
    ['no manifest', /^capture-manifest: .*capture\.json/, (files) => files.delete('capture.json')],
    [
      'a field of another type',
      /^capture-manifest: .*camera\.width/,
      (_, manifest) => Object.assign(manifest.camera, { width: 'wide' }),
    ],
    [
      'a missing photograph',
      /^capture-file: photos\/0003\.png \(shots\[3\]\.photo.*no such file/,
      (files) => files.delete('photos/0003.png'),
    ],
    [
      'a damaged photograph',
      /^capture-file: photos\/0003\.png.*not a readable PNG/,
      (files) =>
        files.set('photos/0003.png', files.get('photos/0003.png')?.slice(0, 5000) ?? new Blob()),
    ],
    [
      'a photograph of another size',
      /^capture-size: photos\/0003\.png.*8x8 pixels; capture\.json says 64x64/,
      async (files, _, png) => files.set('photos/0003.png', await png(8, 8)),
    ],
    [
      'an 8-bit photograph',
      /^capture-photograph: photos\/0003\.png.*8-bit RGB.*16-bit linear RGB PNG; export it again from raw/,
      async (files, _, png) => files.set('photos/0003.png', await png(64, 64)),
    ],
    [
      'a photograph as pattern',
      /^capture-pattern: photos\/0001\.png.*16-bit RGB; a pattern must be an 8-bit/,
      (_, manifest) => {
        Object.assign(manifest.light, { width: 64, height: 64 });
        Object.assign(manifest.shots[0], { pattern: 'photos/0001.png' });
      },
    ],
    ['too few patterns', /^recover-patterns: /, (_, manifest) => manifest.shots.splice(2)],
    [
      'photographs of other patterns',
      /^recover-mismatch: the photographs do not follow from their patterns/,
      (_, { shots }) => {
        const [first] = shots.map((/** @type {any} */ { photo }) => photo);
        for (const [i, shot] of shots.entries()) shot.photo = shots[i + 1]?.photo ?? first;
      },
    ],
    [
      'photographs that are all the same',
      /^recover-(no-signal|mismatch): /,
      (_, { shots }) => {
        for (const shot of shots) shot.photo = 'photos/0000.png';
      },
    ],
    [
      'a correspondence off the light plane',
      /^recover-correspondence: /,
      (_, manifest) =>
        Object.assign(manifest, {
          correspondence: {
            affine: [
              [0.5, 0, 1000],
              [0, 0.5, 1000],
            ],
          },
        }),
    ],
    [
      'no Gray code',
      /^capture-manifest: .*graycode/,
      (_, manifest) => {
        manifest.graycode = [];
        delete manifest.correspondence;
      },
    ],
    ['an even window', /^recover-options: window is 4/, () => {}, { window: 4 }],
    ['an unknown method', /^recover-options: method is "magic"/, () => {}, { method: 'magic' }],
    [
      'an unknown basis',
      /^recover-options: basis is "wavelet"/,
      () => {},
      { method: 'bpdn', basis: 'wavelet' },
    ],
    ['little memory', /^recover-memory: .*MiB/, () => {}, {}, { memoryLimit: 1 << 20 }],
  ];
  for (const [name, expected, change, settings, options] of cases) {
    await step(name, async () => expect(await failOf(change, settings, options)).toMatch(expected));
  }
  await waitForWorkers(page, 0);
  await step('saturated photographs', async () => {
    const message = await page.evaluate(async () => {
      const { fails } = /** @type {any} */ (globalThis);
      const white = { width: 8, height: 8, data: new Float32Array(192).fill(Number.NaN) };
      const pattern = (/** @type {number} */ i) => ({
        width: 8,
        height: 8,
        data: Float32Array.from({ length: 64 }, (_, m) => ((m * 31 + i * 17) % 7) / 7),
      });
      const patterns = Array.from({ length: 20 }, (_, i) => pattern(i));
      const photographs = patterns.map(() => white);
      const correspondence = [
        [1, 0, 0],
        [0, 1, 0],
      ];
      const { code, message } = await fails(
        { patterns, photographs, correspondence },
        { window: 3 },
      );
      return `${code}: ${message}`;
    });
    expect(message).toMatch(/^recover-(overexposed|no-signal): /);
  });
  await step('a photograph of another size among pictures', async () => {
    const message = await page.evaluate(async () => {
      const { fails } = /** @type {any} */ (globalThis);
      const picture = (/** @type {number} */ side) => ({
        width: side,
        height: side,
        data: new Float32Array(3 * side * side),
      });
      const correspondence = [
        [1, 0, 0],
        [0, 1, 0],
      ];
      const input = {
        patterns: [picture(8), picture(8)],
        photographs: [picture(8), picture(9)],
        correspondence,
      };
      const { code, message } = await fails(input);
      return `${code}: ${message}`;
    });
    expect(message).toMatch(/^capture-size: photograph 1 is 9x9/);
  });
});

test('a module that is missing, or of another release, is named', async ({ openPage }) => {
  const page = await openRecovery(openPage);
  const body = Buffer.concat([
    readFileSync(join(WASM, 'recovery_bg.wasm')),
    // A custom section changes nothing but the hash.
    Buffer.from([0, 2, 1, 0x61]),
  ]);
  const fetched = /** @type {string[]} */ ([]);
  await page.context().route('**/wasm/recovery_bg.wasm', (route) => {
    fetched.push(route.request().url());
    return route.fulfill({ body, contentType: 'application/wasm' });
  });
  const { code, message } = await page.evaluate('fails({ folder }, {}, { workers: 1 })');
  expect(code).toBe('wasm-unavailable');
  expect(message).toContain('same release');
  expect(fetched).toHaveLength(1);
});

test('a browser without SIMD is told so', async ({ openPage }) => {
  const page = await openPage('/plain', {
    before: () => {
      WebAssembly.validate = () => false;
    },
  });
  await prepareRecovery(page);
  const { code, message } = await page.evaluate('fails({ folder })');
  expect(code).toBe('wasm-simd');
  expect(message).toContain('SIMD');
});

test('twenty recoveries leave no memory and no workers', async ({ openPage }) => {
  test.slow();
  const page = await openRecovery(openPage);
  const session = await page.context().newCDPSession(page);
  const usage = async () => {
    for (let i = 0; i < 3; i += 1) await session.send('HeapProfiler.collectGarbage');
    const { usedSize, backingStorageSize = 0 } = /** @type {any} */ (
      await session.send('Runtime.getHeapUsage')
    );
    return { heap: usedSize, buffers: backingStorageSize, workers: recoveryWorkers(page).length };
  };
  const recover = (/** @type {number} */ count) =>
    page.evaluate(async (count) => {
      const { recovery, folder } = /** @type {any} */ (globalThis);
      for (let i = 0; i < count; i += 1) {
        const settings = { method: 'nnls', window: 5 };
        const recovered = await recovery.recover({ folder, shots: 24 }, settings, { workers: 2 });
        await recovered.load({ signal: new AbortController().signal });
        recovered.free();
      }
    }, count);
  await recover(3);
  await waitForWorkers(page, 0);
  const before = await usage();
  await recover(20);
  await waitForWorkers(page, 0);
  const after = await usage();
  note(`${JSON.stringify(before)} → ${JSON.stringify(after)}`);
  expect(after.workers).toBe(0);
  expect(after.heap - before.heap, 'the heap of scripts').toBeLessThan(10 * 10_000);
  expect(after.buffers - before.buffers, 'array buffers').toBeLessThan(10 * 10_000);
});

test('a dropped zip is opened', async ({ openPage }) => {
  const page = await openRecovery(openPage, '/monitored');
  const body = await zipFixture();
  await page.route('**/fixtures/glass-s.zip', (route) => route.fulfill({ body }));
  const { names, code } = await page.evaluate(async () => {
    const { recovery } = /** @type {any} */ (globalThis);
    const zip = await (await fetch('/fixtures/glass-s.zip')).blob();
    const opened = await recovery.openCaptureFolder(zip);
    const code = await recovery
      .openCaptureFolder(zip.slice(0, 1000))
      .catch((/** @type {any} */ e) => e.code);
    return { names: [...opened.keys()].sort().slice(0, 2), code };
  });
  expect(names).toEqual(['capture.json', 'graycode/x0n.png']);
  expect(code).toBe('capture-file');
});
