import { type BackendChangeEvent, RelightablePhoto } from 'relightable-photo';

const photo = document.querySelector('relightable-photo');
if (!(photo instanceof RelightablePhoto)) throw new Error('The element is not defined.');
photo.addEventListener('backendchange', ({ backend, reason }: BackendChangeEvent) => {
  document.title = `${backend} ${reason}`;
});
