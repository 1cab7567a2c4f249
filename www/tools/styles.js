/** Lets TypeScript import style sheets as minified text. */

import { readFile } from 'node:fs/promises';
import { transform } from 'esbuild';

/** @type {import('esbuild').Plugin} */
export const styles = {
  name: 'styles',
  setup({ onLoad }) {
    onLoad({ filter: /\.css$/ }, async ({ path }) => {
      const css = await readFile(path, 'utf8');
      const { code } = await transform(css, { loader: 'css', minify: true, target: 'es2022' });
      return { contents: code.trim(), loader: 'text' };
    });
  },
};
