/** The page "Recover": settings, keyboard, the light, faults, languages, accessibility and widths. */

import { cpSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { LANGUAGES } from '../../www/site/recover/language.js';
import english from '../../www/site/recover/texts/en.js';
import { expect, test } from './fixtures.js';
import { axeViolations, horizontalOverflow, saveScreenshot } from './page-helpers.js';
import { testRecoverPage } from './recover-page-every-browser.js';
import { FIXTURE } from './recovery-page.js';

/** @typedef {import('@playwright/test').Page} Page */

const repository = join(import.meta.dirname, '../..');
const axe = readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');

/** Texts of the page by their keys. */
function pageTexts() {
  const html = readFileSync(join(repository, 'www/pages/recover.html'), 'utf8');
  return [...html.matchAll(/data-text="([^"]+)"/g)].map(([, key = '']) => key);
}

/** Recovers from so many patterns. @param {Page} page @param {number} patterns */
async function recover(page, patterns) {
  await page.locator('#patterns').fill(String(patterns));
  const start = page.getByRole('button', { name: 'Recover', exact: true });
  if (await page.locator('#cancel').isHidden()) await start.click();
  const done = new RegExp(`Recovered from ${patterns} patterns in [\\d.]+ s: SNR -?[\\d.]+ dB`);
  await expect(page.locator('#announcement')).toHaveText(done, { timeout: 100_000 });
}

/** The linear sum of a canvas's codes at the left and at the right. @param {Page} page @param {string} id */
async function halves(page, id) {
  return page.evaluate((id) => {
    const canvas = /** @type {HTMLCanvasElement} */ (document.getElementById(id));
    const { width, height } = canvas;
    const data = canvas.getContext('2d')?.getImageData(0, 0, width, height).data ?? [];
    const sums = [0, 0];
    for (const [i, code] of [...data].entries()) {
      if (i % 4 === 3) continue;
      const side = (i >> 2) % width < width / 2 ? 0 : 1;
      sums[side] = (sums[side] ?? 0) + code;
    }
    return { left: sums[0] ?? 0, right: sums[1] ?? 0 };
  }, id);
}

/** Has the page take its tab for hidden. @param {Page} page @param {boolean} isHidden */
async function hideTab(page, isHidden) {
  await page.evaluate((isHidden) => {
    Object.defineProperty(document, 'hidden', { configurable: true, get: () => isHidden });
    document.dispatchEvent(new Event('visibilitychange'));
  }, isHidden);
}

/** Copies the fixture's capture and changes it. @param {(folder: string) => void} change */
function changedCapture(change) {
  const folder = join(mkdtempSync(join(tmpdir(), 'capture-')), 'glass');
  cpSync(FIXTURE, folder, { recursive: true });
  change(folder);
  return folder;
}

/** Lists each pattern with the next photograph. @param {string} folder */
function shiftPhotographs(folder) {
  const path = join(folder, 'capture.json');
  const manifest = JSON.parse(readFileSync(path, 'utf8'));
  const { shots } = /** @type {{ shots: { photo: string }[] }} */ (manifest);
  const shifted = shots.map((shot, i) => ({ ...shot, photo: (shots[i + 1] ?? shots[0])?.photo }));
  writeFileSync(path, JSON.stringify({ ...manifest, shots: shifted }));
}

/** @type {{ title: string, change: (folder: string) => void, refusedAt?: 'choice' | 'start', code: string, message: RegExp }[]} */
const FAULTY_CAPTURES = [
  {
    title: 'without capture.json',
    change: (folder) => rmSync(join(folder, 'capture.json')),
    refusedAt: 'choice',
    code: 'capture-manifest',
    message: /capture\.json/,
  },
  {
    title: 'whose manifest is damaged',
    change: (folder) => writeFileSync(join(folder, 'capture.json'), '{'),
    code: 'capture-manifest',
    message: /capture\.json/,
  },
  {
    title: 'with a photograph of another size',
    change: (folder) => cpSync(join(folder, 'patterns/0000.png'), join(folder, 'photos/0003.png')),
    code: 'capture-size',
    message: /photos\/0003\.png/,
  },
  {
    title: 'whose photograph is missing',
    change: (folder) => rmSync(join(folder, 'photos/0003.png')),
    code: 'capture-file',
    message: /photos\/0003\.png/,
  },
  {
    title: "whose photographs are all listed with their neighbours' patterns",
    change: shiftPhotographs,
    code: 'recover-mismatch',
    message: /the photographs do not follow from their patterns/,
  },
];

testRecoverPage(test);

test.describe('a simulated object', () => {
  test('is recovered by keyboard alone; the light moves by keys and pointer', async ({
    openPage,
    step,
  }) => {
    const page = await openPage('/recover.html');
    const start = page.getByRole('button', { name: 'Recover', exact: true });
    await expect(start).toBeEnabled();
    await page.locator('#patterns').focus();
    for (const key of ['Home', 'ArrowRight', 'ArrowRight']) await page.keyboard.press(key);
    await start.focus();
    await page.keyboard.press('Enter');
    const announced = page.locator('#announcement');
    await expect(announced).toHaveText(/^Recovered from 15 patterns .*SNR [\d.]+ dB/, {
      timeout: 100_000,
    });

    await step('the light moves by keys, and text follows', async () => {
      const slider = page.getByLabel('Light from left to right');
      await slider.focus();
      await page.keyboard.press('Home');
      await expect(page.locator('#point-text')).toContainText('Pixel 0, 32');
      const left = await halves(page, 'recovered-picture');
      expect(left.left).toBeGreaterThan(2 * left.right);
      await page.keyboard.press('End');
      await expect(page.locator('#point-text')).toContainText('Pixel 63, 32');
      const right = await halves(page, 'recovered-picture');
      expect(right.right).toBeGreaterThan(2 * right.left);
    });

    await step('the light moves under the pointer, in all three pictures', async () => {
      for (const id of ['true-picture', 'recovered-picture', 'error-picture']) {
        const picture = page.locator(`#${id}`);
        await picture.scrollIntoViewIfNeeded();
        const box = await picture.boundingBox();
        if (!box) throw new Error(`${id} has no box`);
        for (const [share, pixel] of /** @type {const} */ ([
          [0.1, 6],
          [0.9, 57],
        ])) {
          await page.mouse.click(box.x + share * box.width, box.y + box.height / 2);
          await expect(page.locator('#point-text')).toContainText(`Pixel ${pixel}, `);
          const { left, right } = await halves(page, 'true-picture');
          expect(left > right, `${id}: light at ${share}`).toBe(share < 0.5);
        }
      }
    });

    await step('a change starts another recovery, which can be cancelled', async () => {
      // So many patterns that the recovery outlasts the click.
      await page.locator('#patterns').press('End');
      await page.getByLabel('Method').first().selectOption('nnls');
      await hideTab(page, true);
      await expect(page.locator('#job-text')).toHaveText(/^The tab is hidden/);
      await hideTab(page, false);
      await expect(page.locator('#job-text')).toHaveText(/^(Reading|Learning|Recovering)/);
      await page.getByRole('button', { name: 'Cancel' }).click();
      await expect(announced).toHaveText('Cancelled.');
      await expect(page.locator('#cancel')).toBeHidden();
      await expect(start).toBeFocused();
      await recover(page, 10);
    });

    await step('a recovery from each number of patterns adds its point, which stays', async () => {
      await page.getByText('As a table').click();
      const counts = page.locator('#snr-table td:first-child');
      await expect(counts).toHaveText(['10', '15']);
      await page.getByRole('button', { name: 'Recover from 5 to 160 patterns' }).click();
      await expect(counts).toHaveText(['5', '10', '15'], { timeout: 100_000 });
      await page.getByRole('button', { name: 'Cancel' }).click();
      await expect(announced).toHaveText('Cancelled.');
      await expect(counts).toHaveText(['5', '10', '15']);
    });

    await step('the plot and its table have a line for each choice of settings', async () => {
      expect(await page.locator('#snr-plot polyline').count()).toBe(2);
      const heads = await page.locator('#snr-table th').allInnerTexts();
      expect(heads).toStrictEqual(['Patterns', 'Learned prior SNR', 'NNLS SNR']);
    });

    await step('the matrix is shown: its band and its singular values', async () => {
      await page.locator('#singular-plot polyline').nth(1).waitFor();
      const label = await page.locator('#singular-plot svg').getAttribute('aria-label');
      const [middle = 0, last = 0] = [...(label ?? '').matchAll(/([\d.]+) %/g)].map(([, value]) =>
        Number(value),
      );
      expect(label).toMatch(/^Singular values relative to the largest/);
      expect(last).toBeLessThanOrEqual(middle);
      expect(await page.locator('#band').getAttribute('aria-label')).toContain('4,096 pixels');
    });

    await step('the file is saved', async () => {
      const [download] = await Promise.all([
        page.waitForEvent('download'),
        page.getByRole('button', { name: 'Save the .ltm file' }).click(),
      ]);
      expect(download.suggestedFilename()).toBe('simulated-stained-glass.ltm');
      const bytes = readFileSync(await download.path());
      expect(bytes.subarray(1, 4).toString('latin1')).toBe('LTM');
      expect(bytes.length).toBeGreaterThan(10_000);
    });
  });
});

test('a simulation that cannot be loaded is told with its code, and tried again', async ({
  openPage,
}) => {
  const page = await openPage('/recover.html', { locale: 'de' });
  const wasm = '**/simulation_bg.wasm';
  await page.context().route(wasm, (route) => route.abort());
  const start = page.getByRole('button', { name: 'Wiederherstellen', exact: true });
  await start.click();
  const fault = page.getByRole('alert');
  await expect(fault).toContainText('Die Simulation konnte nicht geladen werden');
  await expect(fault).toContainText('Code: simulation-unavailable');
  await page.context().unroute(wasm);
  await start.click();
  await expect(page.locator('#job-text')).toContainText('gelernt');
  await expect(page.locator('#fault')).toBeEmpty();
  await page.getByRole('button', { name: 'Abbrechen' }).click();
});

test.describe('an own capture', () => {
  test('is recovered from a folder, with its needs beforehand and its held-out SNR', async ({
    openPage,
    step,
  }) => {
    const page = await openPage('/recover.html');
    await page.getByLabel('Your own capture').check();
    const start = page.getByRole('button', { name: 'Recover', exact: true });
    await expect(start).toBeDisabled();
    await page.locator('#folder').setInputFiles(FIXTURE);
    await expect(page.locator('#chosen')).toContainText(
      /glass-s: \d+ files · 64 × 64 pixels, 32 × 32 light elements · Recovery takes about \d+ MB of memory and \d+ s/,
    );
    await start.click();
    const facts = page.locator('#facts');
    await expect(facts).toContainText('54 patterns', { timeout: 100_000 });
    const heldOut = Number(/SNR ([\d.]+) dB on pictures/.exec(await facts.innerText())?.[1]);
    expect(heldOut).toBeGreaterThan(25);

    await step('the element shows it', async () => {
      await page.locator('relightable-photo canvas').waitFor();
      for (const id of ['true-picture', 'accuracy']) {
        await expect(page.locator(`#${id}`)).toBeHidden();
      }
      await expect(page.locator('#recovered-picture')).toBeVisible();
    });

    await step('another folder takes its place', async () => {
      await page.getByLabel('Method').nth(1).selectOption('nnls');
      await page.locator('#folder').setInputFiles(FIXTURE);
      await start.click();
      await expect(page.locator('#announcement')).toHaveText(/Recovered from 54 photographs/, {
        timeout: 100_000,
      });
      expect(await page.locator('relightable-photo').count()).toBe(1);
    });
  });

  test('is accepted when it is dropped', async ({ openPage }) => {
    const page = await openPage('/recover.html');
    await page.getByLabel('Your own capture').check();
    // The script must be there before: a drop can be read only while its event is handled.
    await page.waitForLoadState('networkidle');
    await page.evaluate(async () => {
      const zip = await (await fetch('/glass-s.zip')).blob();
      const dataTransfer = new DataTransfer();
      dataTransfer.items.add(new File([zip], 'window.zip', { type: 'application/zip' }));
      const drop = document.getElementById('drop');
      for (const type of ['dragover', 'drop']) {
        drop?.dispatchEvent(new DragEvent(type, { dataTransfer, bubbles: true, cancelable: true }));
      }
    });
    await expect(page.locator('#chosen')).toContainText('64 × 64 pixels');
  });

  test('is recovered without a photograph of another pattern, which the page names', async ({
    openPage,
  }) => {
    const page = await openPage('/recover.html');
    await page.getByLabel('Your own capture').check();
    await page.getByLabel('Method').nth(1).selectOption('nnls');
    const folder = changedCapture((folder) =>
      cpSync(join(folder, 'photos/0007.png'), join(folder, 'photos/0003.png')),
    );
    await page.locator('#folder').setInputFiles(folder);
    await page.getByRole('button', { name: 'Recover', exact: true }).click();
    await expect(page.locator('#warnings li')).toHaveText(
      ['shots[3] is left out: it shows the pattern of shots[7].'],
      { timeout: 100_000 },
    );
    await expect(page.locator('#fault')).toBeEmpty();
    rmSync(folder, { recursive: true });
  });

  test('is refused if it is faulty, with the fault, its code and the remedy', async ({
    openPage,
    step,
  }) => {
    const page = await openPage('/recover.html');
    await page.evaluate(axe);
    await page.getByLabel('Your own capture').check();
    const start = page.getByRole('button', { name: 'Recover', exact: true });
    for (const { title, change, refusedAt = 'start', code, message } of FAULTY_CAPTURES) {
      const folder = changedCapture(change);
      await step(title, async () => {
        await page.locator('#folder').setInputFiles(folder);
        const fault = page.getByRole('alert');
        if (refusedAt === 'start') {
          await expect(page.locator('#chosen')).toContainText('glass: ');
          await start.click();
        }
        await expect(fault).toContainText(message, { timeout: 100_000 });
        await expect(fault).toContainText(`Code: ${code}`);
        expect(await axeViolations(page)).toStrictEqual([]);
      });
      rmSync(folder, { recursive: true });
    }
  });
});

test.describe('the texts', () => {
  test('are complete in every language, with the same values', async () => {
    const keys = [...new Set([...pageTexts(), ...Object.keys(english)])].sort();
    const values = (/** @type {string | undefined} */ text) =>
      [...(text ?? '').matchAll(/\{\w+\}/g)].map(String).sort();
    for (const code of Object.keys(LANGUAGES).filter((code) => code !== 'en')) {
      const { default: table } = await import(`../../www/site/recover/texts/${code}.js`);
      expect(Object.keys(table).sort(), code).toStrictEqual(keys);
      for (const [key, text] of Object.entries(english)) {
        expect(values(table[key]), `${code}: ${key}`).toStrictEqual(values(text));
      }
    }
  });

  test('are in the language of the browser or the one chosen, and fit', async ({
    openPage,
    step,
  }) => {
    const page = await openPage('/recover.html', { locale: 'de-CH' });
    const article = page.locator('#recover');
    await expect(page.getByRole('heading', { level: 1 })).toHaveText('Wiederherstellen');
    for (const code of Object.keys(LANGUAGES)) {
      await page.locator('#language').selectOption(code);
      await expect(article).toHaveAttribute('lang', code);
      for (const width of [320, 390, 820, 1440]) {
        await page.setViewportSize({ width, height: 900 });
        await step(`${code} does not scroll sideways at ${width} pixels`, async () =>
          expect(await horizontalOverflow(page)).toBe(0),
        );
      }
    }
    await page.locator('#language').selectOption('ja');
    await page.reload();
    await expect(article).toHaveAttribute('lang', 'ja');
  });
});

test.describe('accessibility', () => {
  test('axe finds nothing, light and dark, at every width', async ({ openPage, step }) => {
    const page = await openPage('/recover.html', { reducedMotion: 'reduce' });
    await page.evaluate(axe);
    /** @param {string} state */
    const check = async (state) => {
      for (const width of [390, 1440]) {
        await page.setViewportSize({ width, height: 900 });
        await step(`${state} does not scroll sideways at ${width} pixels`, async () =>
          expect(await horizontalOverflow(page)).toBe(0),
        );
        for (const colorScheme of /** @type {const} */ (['dark', 'light'])) {
          await page.emulateMedia({ colorScheme });
          await step(`${state}, ${colorScheme}, ${width} pixels`, async () =>
            expect(await axeViolations(page)).toStrictEqual([]),
          );
          await saveScreenshot(page, `recover-${state}-${colorScheme}-${width}.png`);
        }
      }
    };
    await check('start');
    await page.getByLabel('Method').first().selectOption('nnls');
    await page.getByRole('button', { name: 'Recover', exact: true }).click();
    await page.getByText('s left').first().waitFor();
    await check('running');
    await page.locator('#singular-plot polyline').nth(1).waitFor();
    await page.getByText('As a table').click();
    await check('simulated');
    await page.getByLabel('Your own capture').check();
    await page.getByLabel('Method').nth(1).selectOption('nnls');
    await page.locator('#folder').setInputFiles(FIXTURE);
    await page.getByRole('button', { name: 'Recover', exact: true }).click();
    await page.locator('relightable-photo canvas').waitFor();
    await check('own');
  });
});
