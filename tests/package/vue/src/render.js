/** Prints what a server renders. */
import { createSSRApp } from 'vue';
import { renderToString } from 'vue/server-renderer';
import Window from './Window.vue';

console.log(await renderToString(createSSRApp(Window, { src: '/photos/glass.ltm' })));
