import { createApp } from 'vue';
import Window from './Window.vue';

const src = new URLSearchParams(location.search).get('src');
createApp(Window, { src }).mount('#app');
