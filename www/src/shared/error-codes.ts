/**
 * The codes of all errors and warnings. `npm run docs` writes docs/troubleshooting.md from the comments: the cause, what
 * visitors see, and the remedy. Pages may rely on the codes.
 */

/** The page */
export interface PageFaults {
  /**
   * An attribute has an invalid value.
   * @visitor no change: the last valid value, or the default, stays in effect. A message only if `src` is invalid
   *   and there is no picture.
   * @remedy Correct the value; the message lists the valid ones. [element.md](element.md#attributes) has all
   *   attributes.
   */
  attribute: true;
  /**
   * The text for `setState()` has an invalid value.
   * @visitor the page's own light and view instead of each invalid value.
   * @remedy Use a text of `getState()`. Check that no program shortened the address.
   */
  state: true;
  /**
   * The element has no `src`.
   * @visitor an empty frame with a message.
   * @remedy Set `src` to the address of the `.ltm` file.
   */
  'src-missing': true;
  /**
   * A script called a method such as `toBlob()` before the photograph was loaded.
   * @visitor nothing; only the script gets the error.
   * @remedy Wait for the `load` event.
   */
  'not-loaded': true;
  /**
   * A bug in this software.
   * @visitor a message that an internal error occurred.
   * @remedy Report it with the message, the browser and, if possible, the file.
   */
  internal: true;
}

/** The network */
export interface NetworkFaults {
  /**
   * The visitor's device has no network, so the photograph, a script or a module could not be fetched.
   * @visitor a message that they are offline, with a button to try again.
   * @remedy None needed: the photograph is loaded when the network returns.
   */
  offline: true;
  /**
   * The server cannot be reached, or does not allow this page to read the file.
   * @visitor a message that the file cannot be fetched.
   * @remedy Open the file's address in a tab. If it is on another host, see [other origins](#other-origins).
   */
  'http-network': true;
  /**
   * The page's content security policy does not name the file's host in `connect-src`.
   * @visitor a message that a policy blocks the file.
   * @remedy Add the host that the message names: [content security policy](#content-security-policy).
   */
  'csp-connect': true;
  /**
   * The server does not have the file, or refuses to send it.
   * @visitor a message with the server's status, such as 404.
   * @remedy Check the address: most servers distinguish upper and lower case. 403: check the file's permissions.
   *   503: try later.
   */
  'http-status': true;
  /**
   * The server sent HTML instead of the file, for example a log-in page, or the start page for every unknown
   * address.
   * @visitor a message that the server sent a web page.
   * @remedy Open the address in a tab. Configure the server to answer 404 for missing files.
   */
  'http-type': true;
  /**
   * The transfer ended early several times.
   * @visitor a message that the file is incomplete.
   * @remedy Try again. If it always ends at the same byte, the file on the server is incomplete: upload it again.
   */
  'http-short': true;
  /**
   * The connection is open, but the server sends nothing.
   * @visitor a message that no data has arrived for some time.
   * @remedy Try another network. A proxy may delay large files.
   */
  'http-stalled': true;
  /**
   * The file was replaced while the element read it, more than once; or several servers behind one address have
   * different files.
   * @visitor a message that the file was replaced.
   * @remedy Load again. All servers must send the same strong `ETag` for the same file.
   */
  'http-changed': true;
  /**
   * A part of a compressed response is not a part of the file.
   * @visitor a message that the server compresses the file.
   * @remedy Disable compression for `.ltm`: [ranges](#ranges-and-compression).
   */
  'http-encoding': true;
  /**
   * The server, a proxy or a cache answers `Range` requests incorrectly.
   * @visitor a message that the server sent the wrong bytes.
   * @remedy Fix or bypass the cache: [ranges](#ranges-and-compression).
   */
  'http-range': true;
}

/** The script's own files */
export interface ScriptFaults {
  /**
   * The `wasm/` folder is not in the script's folder, or is of another release than the script, which checks its hash.
   * @visitor a message that WebAssembly could not be loaded.
   * @remedy Copy the whole `dist` folder, or set `RelightablePhotoElement.wasmUrl`. See also
   *   [content security policy](#content-security-policy) and [media types](#media-types).
   */
  'wasm-unavailable': true;
  /**
   * The page's content security policy does not allow WebAssembly.
   * @visitor a message that a policy blocks WebAssembly.
   * @remedy Add `'wasm-unsafe-eval'` to `script-src`: [content security policy](#content-security-policy).
   */
  'csp-wasm': true;
  /**
   * The browser or device has no WebAssembly SIMD, which recovery in the page needs.
   * @visitor what the page shows; the script gets the error.
   * @remedy Use a current browser, or `ltm-export recover`.
   */
  'wasm-simd': true;
  /**
   * The script of the controls could not be loaded. A missing translation is not reported: its texts are in English.
   * @visitor the picture without controls.
   * @remedy Copy the whole `dist` folder, and do not rename its files: the scripts load each other by name.
   */
  'controls-unavailable': true;
  /**
   * The script for gestures, keys and animations could not be loaded.
   * @visitor a picture that does not react, and whose fire rests.
   * @remedy Copy the whole `dist` folder, and do not rename its files: the scripts load each other by name.
   */
  'input-unavailable': true;
  /**
   * The script for photographs of several levels could not be loaded.
   * @visitor the coarsest level of the picture.
   * @remedy Copy the whole `dist` folder, and do not rename its files: the scripts load each other by name.
   */
  'levels-unavailable': true;
  /**
   * The script of the overview, which the `minimap` attribute asks for, could not be loaded.
   * @visitor the picture without an overview.
   * @remedy Copy the whole `dist` folder, and do not rename its files: the scripts load each other by name.
   */
  'minimap-unavailable': true;
  /**
   * The decoder's worker stopped, mostly because memory ran out.
   * @visitor a message while the photograph loads.
   * @remedy Close other tabs. Make a smaller file with `ltm-export recover --max-bytes`, or with fewer camera
   *   pixels.
   */
  'worker-unavailable': true;
  /**
   * The browser stopped a worker that held a part of the photograph.
   * @visitor a picture that does not react for a moment.
   * @remedy The element fetches the photograph again, up to five times. If the error persists, reduce memory use as
   *   above.
   */
  'photo-lost': true;
}

/** The file */
export interface FileFaults {
  /**
   * The file is of another type.
   * @visitor a message that the file is not a relightable photograph.
   * @remedy Check which file you uploaded. `ltm-export inspect` prints its contents.
   */
  'format-magic': true;
  /**
   * An FTP program or version control system changed line ends.
   * @visitor a message that the file was transferred as text.
   * @remedy Upload in binary mode; for git: `*.ltm binary` in `.gitattributes`.
   */
  'format-text-mode': true;
  /**
   * The file is newer than the element, or older than version 1.0.
   * @visitor a message that the file's version is unknown.
   * @remedy Update the element, or recover the file again.
   */
  'format-version': true;
  /**
   * At least one byte has changed since the file was written.
   * @visitor a message that the file is damaged.
   * @remedy Run `ltm-export verify` on your copy, and upload it again.
   */
  'format-checksum': true;
  /**
   * The program that wrote the file violates the format, or data was appended to the file.
   * @visitor a message that the file's content is invalid.
   * @remedy Export it again. If `ltm-export verify` accepts the file, report a bug.
   */
  'format-invalid': true;
  /**
   * The photograph is larger than the element's memory limit.
   * @visitor a message that the file exceeds a limit.
   * @remedy Recover with fewer camera pixels or a smaller window.
   */
  'format-limit': true;
  /**
   * The end of the file is missing on the server.
   * @visitor a message that the file is truncated.
   * @remedy Compare its length with that of your copy, and upload it again.
   */
  'format-truncated': true;
}

/** The light */
export interface LightFaults {
  /**
   * The image or video is from another origin, and the page may not read it.
   * @visitor the last light.
   * @remedy Set `crossorigin` on the element or the image, and send `Access-Control-Allow-Origin` from its server:
   *   [other origins](#other-origins).
   */
  'light-tainted': true;
  /**
   * The image or video could not be loaded, played or read.
   * @visitor the last light.
   * @remedy Open its address in a tab. A video must be WebM or MP4 with a codec that the browser supports, and
   *   `media-src` must allow it.
   */
  'light-source': true;
  /**
   * There is no built-in light with this name.
   * @visitor the last light.
   * @remedy Use `flood`, `torch`, `checkerboard`, `stripes`, `spectrum` or `fire`.
   */
  'light-name': true;
  /**
   * The array of a linear light does not match its width and height.
   * @visitor the last light.
   * @remedy `data` needs width × height × 3 numbers.
   */
  'light-size': true;
  /**
   * A number of a linear light is negative, infinite or NaN.
   * @visitor the last light.
   * @remedy Check the numbers before you set the light.
   */
  'light-value': true;
}

/** Drawing */
export interface DrawingFaults {
  /**
   * The browser or device does not support WebGPU or WebGL2, or not for a photograph of this size.
   * @visitor the picture that the next backend draws, and a message only if no backend is left.
   * @remedy Remove the `backend` attribute, or add `cpu` to it: [graphics processors](#graphics-processors).
   */
  'backend-unavailable': true;
  /**
   * The operating system or browser reset the graphics device.
   * @visitor a short pause, then the picture again; a message if that fails.
   * @remedy Usually none. If it happens often, see [graphics processors](#graphics-processors).
   */
  'backend-lost': true;
}

/** Recovery in the page */
export interface RecoveryFaults {
  /**
   * The folder has no `capture.json`, or a field of it is missing or invalid.
   * @visitor what the page shows, as for all errors of `recover()`.
   * @remedy Give the folder that holds `capture.json`; the message names the field: [capture.md](capture.md).
   */
  'capture-manifest': true;
  /**
   * A file that `capture.json` names is missing, damaged or cannot be read.
   * @visitor what the page shows.
   * @remedy Add the file, correct its name, or export or copy it again.
   */
  'capture-file': true;
  /**
   * A picture has another size than the others, or than `capture.json` says.
   * @visitor what the page shows.
   * @remedy All photographs must have the camera's size, all patterns that of the light plane.
   */
  'capture-size': true;
  /**
   * A photograph is not a 16-bit linear RGB PNG without interlacing.
   * @visitor what the page shows.
   * @remedy Export it again from raw. 8-bit photographs cannot be repaired.
   */
  'capture-photograph': true;
  /**
   * A pattern is not an 8-bit grey or RGB PNG.
   * @visitor what the page shows.
   * @remedy Convert it.
   */
  'capture-pattern': true;
  /**
   * A setting or option of `recover()` is invalid.
   * @visitor what the page shows.
   * @remedy Correct the value that the message names: [recover.md](recover.md).
   */
  'recover-options': true;
  /**
   * There are too few patterns, or fewer shots than were asked for.
   * @visitor what the page shows.
   * @remedy Photograph the object under more patterns, about 80 for a good result.
   */
  'recover-patterns': true;
  /**
   * The camera, the light plane or the window is too large or has no extent.
   * @visitor what the page shows.
   * @remedy Correct the size that the message names.
   */
  'recover-geometry': true;
  /**
   * The correspondence between camera pixels and light elements is missing, unclear or wrong.
   * @visitor what the page shows.
   * @remedy Photograph the Gray code again with more light, or give the correspondence.
   */
  'recover-correspondence': true;
  /**
   * The photographs show no light from the patterns.
   * @visitor what the page shows.
   * @remedy Check the black level, the exposure, and that each photograph shows its own pattern.
   */
  'recover-no-signal': true;
  /**
   * Photographs do not match the patterns that they are listed with.
   * @visitor what the page shows.
   * @remedy Correct these shots or take them out. If there are many, the correspondence may be mirrored.
   */
  'recover-mismatch': true;
  /**
   * Nearly all of the picture is saturated.
   * @visitor what the page shows.
   * @remedy Photograph with less exposure, or add shots with less.
   */
  'recover-overexposed': true;
  /**
   * The recovery takes more memory than its limit, or than the browser has.
   * @visitor what the page shows.
   * @remedy Recover with fewer camera pixels, photographs or workers, raise `memoryLimit`, or use `ltm-export`.
   */
  'recover-memory': true;
}

/** Any code; a newer WebAssembly module may add some. */
export type ErrorCode =
  | keyof PageFaults
  | keyof NetworkFaults
  | keyof ScriptFaults
  | keyof FileFaults
  | keyof LightFaults
  | keyof DrawingFaults
  | keyof RecoveryFaults
  | (string & {});
