import { decode, relight } from '/relightable-photo/core.js';

try {
  const photo = await decode('/photos/glass.ltm');
  const { width, height, pixels } = await relight(photo, 'torch');
  postMessage([width, height, ...pixels].join());
} catch (error) {
  postMessage(String(error));
}
