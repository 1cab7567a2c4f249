/** Starts the system's Chromium headless, with software renderers for WebGPU and WebGL2. */

import { chromium } from 'playwright-core';

/**
 * SwiftShader renders WebGPU and WebGL2, so that machines with and without a GPU produce the same pictures. Vulkan runs
 * on SwiftShader as well: otherwise Chromium loses the WebGPU device when it presents the first frame.
 */
const ARGUMENTS = [
  '--no-sandbox',
  '--enable-unsafe-webgpu',
  '--use-webgpu-adapter=swiftshader',
  '--enable-features=Vulkan',
  '--use-vulkan=swiftshader',
  '--use-angle=swiftshader',
  '--enable-unsafe-swiftshader',
  '--ignore-gpu-blocklist',
];

/**
 * Launch options of Playwright.
 *
 * @param {string[]} args more of Chromium's arguments
 * @returns {{ executablePath: string, args: string[] }}
 */
export function chromiumOptions(...args) {
  const executablePath = process.env['CHROMIUM'];
  if (!executablePath) {
    throw new Error('CHROMIUM does not name a browser: run ". pkg-scripts/env.sh" first');
  }
  return { executablePath, args: [...ARGUMENTS, ...args] };
}

/** @returns {Promise<import('playwright-core').Browser>} */
export function launchChromium() {
  return chromium.launch(chromiumOptions());
}
