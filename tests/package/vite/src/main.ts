import { type BackendChangeEvent, RelightablePhotoElement } from 'relightable-photo';

const photo = document.querySelector('relightable-photo');
if (!(photo instanceof RelightablePhotoElement)) throw new Error('The element is not defined.');
photo.addEventListener('backendchange', ({ backend, reason }: BackendChangeEvent) => {
  document.title = `${backend} ${reason}`;
});
