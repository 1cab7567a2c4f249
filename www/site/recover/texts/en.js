/** Messages of the page's scripts. The page itself has the other English texts, under `data-text`. */

export default {
  'job.simulating': 'Simulating the photographs',
  'job.reading': 'Reading the capture',
  'job.preparing': 'Learning from all photographs',
  'job.recovering': 'Recovering the transport',
  'job.encoding': 'Writing the file',
  'job.left': '{seconds} s left',
  'job.cancelled': 'Cancelled.',
  'job.hidden':
    'The tab is hidden, so the browser may slow the work down; it goes on when you return.',
  'done.simulated': 'Recovered from {patterns} patterns in {seconds} s: SNR {snr} dB.',
  'done.own': 'Recovered from {patterns} photographs in {seconds} s.',
  'done.file': 'The file has {size} MB.',
  'fact.size': '{width} × {height} pixels, {lightWidth} × {lightHeight} light elements',
  'fact.patterns': '{patterns} patterns',
  'fact.window': 'window {window} × {window}',
  'fact.rank': 'rank {rank}',
  'fact.snr': 'SNR {snr} dB against the true transport',
  'fact.expected': 'SNR {snr} dB expected',
  'fact.heldOut': 'SNR {snr} dB on pictures that the recovery did not use',
  'own.files': '{name}: {files} files',
  'own.estimate': 'Recovery takes about {memory} MB of memory and {seconds} s.',
  'point.text':
    'Pixel {x}, {y} and light element {u}, {v}: 90\u00a0% of its light comes from {elements} of {all} elements of the window.',
  'point.snr': 'The pictures under this light: SNR {snr} dB.',
  'picture.true': 'True picture under a spot of light at {x} %, {y} %',
  'picture.recovered': 'Recovered picture under a spot of light at {x} %, {y} %',
  'picture.error': 'Difference of the two pictures: SNR {snr} dB',
  'function.true': 'True light transport function of pixel {x}, {y}',
  'function.recovered': 'Recovered light transport function of pixel {x}, {y}',
  'window.map':
    'Light plane of {width} × {height} elements; the window of {window} × {window} elements starts at {u}, {v}',
  'scattering.true': 'True picture when only light element {u}, {v} is on',
  'scattering.recovered': 'Recovered picture when only light element {u}, {v} is on',
  'band.label':
    'The matrix with {pixels} pixels and {elements} light elements: bright diagonal stripes on black',
  'snr.axis': 'SNR in dB',
  'snr.label': 'SNR by the number of patterns: {points}',
  'snr.point': '{patterns} patterns: {snr} dB',
  'singular.axis': 'relative to the largest',
  'singular.number': 'number',
  'singular.label':
    'Singular values relative to the largest: the one in the middle is {middle}, the last {last}',
  'singular.block': 'Shown for the {width} × {height} light elements in the middle.',
  'singular.all': 'Shown for all {width} × {height} light elements and all three channels.',
  'fault.code': 'Code: {code}',
  'job.photographing': 'Photographing the patterns',
  'camera.started': 'The camera runs.',
  'camera.title': 'Photographed in a browser',
  'camera.window.title': 'Patterns',
  'camera.window.opened': 'The pattern window is open.',
  'camera.paused':
    'Paused, because this tab or the pattern window is hidden; the photographs go on when both are visible.',
  'camera.noise':
    'Noise of one frame: {noise} % of full scale. Each photograph is the mean of at least {frames} frames.',
  'camera.unlocked':
    'The browser could not fix this: {settings}. If it changes meanwhile, the recovery is less accurate.',
  'camera.exposure': 'exposure',
  'camera.focus': 'focus',
  'camera.whiteBalance': 'white balance',
  'camera.kept':
    'The photographs of {patterns} patterns are kept: recover from them, or photograph again.',
  'camera.done': '{photographs} photographs were taken.',
  'fault.camera-unsupported':
    'This browser does not give the page a camera. Use a current browser, and open the page by https.',
  'fault.camera-refused':
    'The page may not use the camera. Allow it in the browser’s settings of this page, and start the camera again.',
  'fault.camera-missing': 'No camera was found. Connect one, and start it again.',
  'fault.camera-busy':
    'The camera gives no picture. Close other programs that use it, and start it again.',
  'fault.camera-lost': 'The camera has vanished. Connect it, and start it again.',
  'fault.camera-saturated':
    'Under full light {percent} % of the picture is too bright for the camera. Make the second screen darker, or use another camera.',
  'fault.camera-no-signal':
    'The camera’s picture does not change with the patterns. Point the camera at the second screen, and keep the pattern window visible there.',
  'fault.camera-unstable':
    'The camera’s picture is never still. Fix camera and object, and keep other light away.',
  'fault.patterns-blocked':
    'The browser has blocked the pattern window. Allow pop-up windows for this page, and open it again.',
  'fault.patterns-closed': 'The pattern window is closed. Open it again.',
  'fault.simulation-unavailable':
    'The simulation could not be loaded: {reason}. Check the connection, and try again.',
};
