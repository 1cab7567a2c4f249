/** Observes a light source: reports when its content changes and when it fails. */

import { messageOf, PhotoError } from '../shared/errors.js';
import { toImageLight } from './image-pixels.js';
import type { ImageLight } from './light-setting.js';
import { isInstance, type LightImageSource, type LightSource } from './light-source.js';

export interface LightSourceListener {
  changed(): void;
  /** The source has failed, or works again (`null`). */
  errorChanged(error: PhotoError | null): void;
}

/** Holds listeners and plays streams only between `start` and `stop`. */
export class LightSourceObserver {
  /** The source itself, or a video that plays the stream. */
  readonly picture: LightImageSource;
  readonly image: ImageLight;
  #observing: AbortController | null = null;
  error: PhotoError | null = null;
  /** The fingerprint of the content when the observer was last active. */
  #fingerprint: string;

  constructor(
    readonly source: LightSource,
    private readonly listener: LightSourceListener,
  ) {
    this.picture = isInstance('MediaStream', source) ? createMutedVideo() : source;
    this.image = toImageLight(this.picture);
    this.#fingerprint = fingerprintOf(this.picture);
  }

  /** Reports all changes from now on, and at once a change since `stop`. */
  start(): void {
    if (this.#observing) return;
    this.#observing = new AbortController();
    const { signal } = this.#observing;
    const { source, picture } = this;
    if (isInstance('HTMLImageElement', picture)) this.#observeImage(picture, signal);
    if (isInstance('HTMLVideoElement', picture)) this.#observeVideo(picture, signal);
    if (isInstance('MediaStream', source)) this.#play(source, picture as HTMLVideoElement, signal);
    if (fingerprintOf(picture) !== this.#fingerprint) this.#changed();
  }

  stop(): void {
    if (!this.#observing) return;
    this.#observing.abort();
    this.#observing = null;
    this.#fingerprint = fingerprintOf(this.picture);
  }

  #observeImage(image: HTMLImageElement, signal: AbortSignal): void {
    const fail = () => this.#fail(`The light image could not be loaded: ${image.currentSrc}`);
    // decode() works off the main thread; the first drawImage would block the page otherwise. It rejects
    // if the image gets another address meanwhile, which fires another load event.
    const decode = () =>
      image.decode().then(
        () => signal.aborted || this.#changed(),
        () => signal.aborted || !image.complete || fail(),
      );
    image.addEventListener('load', decode, { signal });
    image.addEventListener('error', fail, { signal });
    if (image.complete && image.currentSrc && image.naturalWidth === 0) fail();
  }

  #observeVideo(video: HTMLVideoElement, signal: AbortSignal): void {
    const fail = () => {
      const reason = video.error?.message || 'the format is unknown, or the file did not arrive.';
      this.#fail(`The light video cannot be played. The browser says: ${reason}`, video.error);
    };
    const changed = () => this.#changed();
    // Some browsers report frames only while the video plays.
    video.addEventListener('loadeddata', changed, { signal });
    video.addEventListener('seeked', changed, { signal });
    video.addEventListener('error', fail, { signal });
    if (video.error) fail();
    observeFrames(video, changed, signal);
  }

  #play(stream: MediaStream, video: HTMLVideoElement, signal: AbortSignal): void {
    // The tracks belong to the page and keep running.
    signal.addEventListener('abort', () => {
      video.pause();
      video.srcObject = null;
    });
    const ended = () => this.#fail('The light stream has ended, or its device was disconnected.');
    video.addEventListener('ended', ended, { signal });
    if (stream.active === false) ended();
    video.srcObject = stream;
    video.play().catch((cause: unknown) => {
      if (signal.aborted) return;
      this.#fail(`The light stream cannot be played: ${messageOf(cause)}`, cause);
    });
  }

  #changed(): void {
    if (this.error) {
      this.error = null;
      this.listener.errorChanged(null);
    }
    this.listener.changed();
  }

  #fail(message: string, cause?: unknown): void {
    if (message === this.error?.message) return;
    this.error = new PhotoError('light-source', message, cause);
    this.listener.errorChanged(this.error);
  }
}

function observeFrames(video: HTMLVideoElement, onFrame: () => void, signal: AbortSignal): void {
  let handle = 0;
  if (typeof video.requestVideoFrameCallback === 'function') {
    const requestNext = () => {
      handle = video.requestVideoFrameCallback(() => {
        requestNext();
        onFrame();
      });
    };
    signal.addEventListener('abort', () => video.cancelVideoFrameCallback(handle));
    requestNext();
    return;
  }
  const requestNext = () => {
    handle = requestAnimationFrame(() => {
      if (video.paused || video.ended) return;
      requestNext();
      onFrame();
    });
  };
  const restart = () => {
    cancelAnimationFrame(handle);
    requestNext();
  };
  video.addEventListener('playing', restart, { signal });
  signal.addEventListener('abort', () => cancelAnimationFrame(handle));
  if (!video.paused) restart();
}

/** A text that changes with the content, as far as the browser exposes it. */
function fingerprintOf(picture: LightImageSource): string {
  if (isInstance('HTMLImageElement', picture)) return `${picture.complete} ${picture.currentSrc}`;
  if (isInstance('HTMLVideoElement', picture)) {
    return `${picture.readyState >= 2} ${picture.currentTime} ${picture.currentSrc}`;
  }
  return '';
}

/** Browsers play a muted inline video without a click. */
function createMutedVideo(): HTMLVideoElement {
  return Object.assign(document.createElement('video'), { muted: true, playsInline: true });
}
