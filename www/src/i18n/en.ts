/** English, which is built into the element's script. It defines the keys that every language must have. */

export const ENGLISH = {
  light: 'Light',
  slider: '2D slider',
  picture: 'Picture',
  controls: 'Controls',
  loading: 'Loading the picture',
  loaded: 'The picture is ready.',
  broken: 'The picture cannot be shown.',
  offline: 'You are offline. The picture is loaded when the connection returns.',
  retry: 'Try again',
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
  // {0} is Ctrl or ⌘.
  wheelHint: '{0} + scroll to zoom',
  touchHint: 'Use two fingers to zoom and move',
  // {0} is a factor.
  zoomed: 'Zoom {0}×',
  // {0} is a direction such as upperLeft, {1} is near or far, {2} is the x and y coordinates.
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

export type StringKey = keyof typeof ENGLISH;

/** All texts in one language; the compiler reports missing ones. `{0}`, `{1}`… are placeholders. */
export type Strings = Readonly<Record<StringKey, string>>;
