/** What the element says to visitors, in seven languages. */

/** In the order in which translations stand below. */
export const LANGUAGES = ['en', 'fr', 'de', 'it', 'es', 'ja', 'zh'] as const;

export type Language = (typeof LANGUAGES)[number];

/** One text in every language; the compiler misses any that is left out. */
type Translations = readonly [
  en: string,
  fr: string,
  de: string,
  it: string,
  es: string,
  ja: string,
  zh: string,
];

export const WORDS = {
  light: ['Light', 'Lumière', 'Licht', 'Luce', 'Luz', '光', '光'],
  slider: [
    '2D slider',
    'curseur 2D',
    '2D-Schieberegler',
    'cursore 2D',
    'control deslizante 2D',
    '2D スライダー',
    '二维滑块',
  ],
  picture: ['Picture', 'Image', 'Bild', 'Immagine', 'Imagen', '画像', '图片'],
  controls: ['Controls', 'Commandes', 'Bedienung', 'Comandi', 'Controles', '操作', '控制'],
  loading: [
    'Loading the picture',
    'Chargement de l’image',
    'Das Bild wird geladen',
    'Caricamento dell’immagine',
    'Cargando la imagen',
    '画像を読み込んでいます',
    '正在加载图片',
  ],
  loaded: [
    'The picture is ready.',
    'L’image est prête.',
    'Das Bild ist da.',
    'L’immagine è pronta.',
    'La imagen está lista.',
    '画像の準備ができました。',
    '图片已就绪。',
  ],
  broken: [
    'The picture cannot be shown.',
    'L’image ne peut pas être affichée.',
    'Das Bild kann nicht gezeigt werden.',
    'L’immagine non può essere mostrata.',
    'No se puede mostrar la imagen.',
    '画像を表示できません。',
    '无法显示图片。',
  ],
  flawed: [
    'Something here does not work as intended.',
    'Quelque chose ne fonctionne pas comme prévu.',
    'Etwas funktioniert hier nicht wie gedacht.',
    'Qualcosa non funziona come previsto.',
    'Algo no funciona como debería.',
    '一部が正しく動作していません。',
    '部分功能未按预期工作。',
  ],
  details: ['Details', 'Détails', 'Einzelheiten', 'Dettagli', 'Detalles', '詳細', '详情'],
  flood: ['Flood', 'Pleine', 'Flutlicht', 'Piena', 'Plena', '全面', '泛光'],
  torch: ['Torch', 'Torche', 'Taschenlampe', 'Torcia', 'Linterna', '懐中電灯', '手电筒'],
  checkerboard: [
    'Checkerboard',
    'Damier',
    'Schachbrett',
    'Scacchiera',
    'Damero',
    '市松模様',
    '棋盘格',
  ],
  stripes: ['Stripes', 'Rayures', 'Streifen', 'Strisce', 'Rayas', '縞模様', '条纹'],
  spectrum: ['Spectrum', 'Spectre', 'Spektrum', 'Spettro', 'Espectro', 'スペクトル', '光谱'],
  fire: ['Fire', 'Feu', 'Feuer', 'Fuoco', 'Fuego', '炎', '火焰'],
  projection: [
    'Projection',
    'Projection',
    'Projektion',
    'Proiezione',
    'Proyección',
    '投影',
    '投影',
  ],
  play: ['Play', 'Lecture', 'Abspielen', 'Riproduci', 'Reproducir', '再生', '播放'],
  pause: ['Pause', 'Pause', 'Anhalten', 'Pausa', 'Pausa', '一時停止', '暂停'],
  zoomIn: ['Zoom in', 'Agrandir', 'Vergrößern', 'Ingrandisci', 'Ampliar', '拡大', '放大'],
  zoomOut: ['Zoom out', 'Réduire', 'Verkleinern', 'Riduci', 'Reducir', '縮小', '缩小'],
  reset: [
    'Reset',
    'Réinitialiser',
    'Zurücksetzen',
    'Ripristina',
    'Restablecer',
    'リセット',
    '重置',
  ],
  tilt: [
    'Light by tilting',
    'Éclairer en inclinant',
    'Licht durch Neigen',
    'Luce inclinando',
    'Luz al inclinar',
    '傾けて照らす',
    '倾斜打光',
  ],
  fullscreen: [
    'Full screen',
    'Plein écran',
    'Vollbild',
    'Schermo intero',
    'Pantalla completa',
    '全画面',
    '全屏',
  ],
  leaveFullscreen: [
    'Leave full screen',
    'Quitter le plein écran',
    'Vollbild beenden',
    'Esci da schermo intero',
    'Salir de pantalla completa',
    '全画面を終了',
    '退出全屏',
  ],
  reveal: [
    'Light it yourself',
    'Éclairez-la vous-même',
    'Selbst beleuchten',
    'Illuminala tu',
    'Ilumínala tú',
    '自分で照らす',
    '亲自打光',
  ],
  // Ctrl or ⌘ comes in the place of {0}.
  wheelHint: [
    '{0} + scroll to zoom',
    '{0} + défilement pour zoomer',
    'Zoomen mit {0} + Scrollen',
    '{0} + scorrimento per lo zoom',
    '{0} + desplazamiento para ampliar',
    '{0} + スクロールで拡大',
    '按住 {0} 滚动以缩放',
  ],
  touchHint: [
    'Use two fingers to zoom and move',
    'Zoomez et déplacez avec deux doigts',
    'Mit zwei Fingern zoomen und verschieben',
    'Usa due dita per zoom e spostamento',
    'Usa dos dedos para ampliar y mover',
    '2 本の指で拡大・移動',
    '用双指缩放和移动',
  ],
  zoomed: [
    'Zoom {0}×',
    'Zoom {0}×',
    'Zoom {0}×',
    'Zoom {0}×',
    'Zoom {0}×',
    'ズーム {0} 倍',
    '缩放 {0} 倍',
  ],
  // A place, near or far, and how far across and down.
  lightAt: [
    'Light from {0}, {1}, {2}',
    'Lumière {0}, {1}, {2}',
    'Licht {0}, {1}, {2}',
    'Luce {0}, {1}, {2}',
    'Luz {0}, {1}, {2}',
    '光：{0}、{1}、{2}',
    '光：{0}，{1}，{2}',
  ],
  lightInMiddle: [
    'Light in the middle',
    'Lumière au centre',
    'Licht in der Mitte',
    'Luce al centro',
    'Luz en el centro',
    '光：中央',
    '光：中央',
  ],
  near: ['near', 'proche', 'nah', 'vicina', 'cerca', '近い', '近'],
  far: ['far', 'loin', 'fern', 'lontana', 'lejos', '遠い', '远'],
  upperLeft: [
    'upper left',
    'en haut à gauche',
    'oben links',
    'in alto a sinistra',
    'arriba a la izquierda',
    '左上',
    '左上',
  ],
  above: ['above', 'en haut', 'oben', 'in alto', 'arriba', '上', '上方'],
  upperRight: [
    'upper right',
    'en haut à droite',
    'oben rechts',
    'in alto a destra',
    'arriba a la derecha',
    '右上',
    '右上',
  ],
  left: ['left', 'à gauche', 'links', 'a sinistra', 'a la izquierda', '左', '左侧'],
  right: ['right', 'à droite', 'rechts', 'a destra', 'a la derecha', '右', '右侧'],
  lowerLeft: [
    'lower left',
    'en bas à gauche',
    'unten links',
    'in basso a sinistra',
    'abajo a la izquierda',
    '左下',
    '左下',
  ],
  below: ['below', 'en bas', 'unten', 'in basso', 'abajo', '下', '下方'],
  lowerRight: [
    'lower right',
    'en bas à droite',
    'unten rechts',
    'in basso a destra',
    'abajo a la derecha',
    '右下',
    '右下',
  ],
} as const satisfies Record<string, Translations>;

/** The name of a text. */
export type Word = keyof typeof WORDS;

/** A text in a language, with what comes in the places of {0}, {1}… */
export function say(word: Word, language: Language, ...values: readonly string[]): string {
  const text: string = WORDS[word][LANGUAGES.indexOf(language)] ?? WORDS[word][0];
  return text.replace(/\{(\d)\}/g, (_, index: string) => values[Number(index)] ?? '');
}

/** The first of some BCP 47 tags that there are texts in; English where there is none. */
export function languageOf(tags: readonly string[]): Language {
  for (const tag of tags) {
    const primary = tag.trim().toLowerCase().split(/[-_]/, 1)[0];
    const known = LANGUAGES.find((language) => language === primary);
    if (known) return known;
  }
  return 'en';
}
