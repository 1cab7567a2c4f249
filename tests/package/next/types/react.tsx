import type { RelightablePhotoElement } from 'relightable-photo';
import type { RelightablePhotoProps } from 'relightable-photo/react';

const props: RelightablePhotoProps = { src: '/window.ltm', exposure: 1, key: 'window' };

export const right = (
  <relightable-photo
    {...props}
    ref={(photo: RelightablePhotoElement | null) => photo?.lightChanged()}
    torch={{ x: 0.5, y: 0.5 }}
    onlightchange={({ light }) => light.length}
  />
);

// @ts-expect-error: numbers only, or text
export const wrong = <relightable-photo src="/window.ltm" exposure={{}} />;
