/** The system's Chromium, without a screen and with its GPU done in software. */

import { chromium } from 'playwright-core';

/**
 * SwiftShader computes WebGPU and WebGL2 on machines without a GPU, and the same on all others. With
 * Vulkan by SwiftShader too, WebGPU can put its frames on the screen; without, Chromium loses the
 * device at the first one.
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

/** @returns {Promise<import('playwright-core').Browser>} */
export function launchChromium() {
  const executablePath = process.env['CHROMIUM'];
  if (!executablePath)
    throw new Error('CHROMIUM does not name a browser: source pkg-scripts/env.sh');
  return chromium.launch({ executablePath, args: ARGUMENTS });
}
