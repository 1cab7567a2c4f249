/** Español. */

export default {
  title: 'Recuperar',
  language: 'Idioma',
  lead: 'Patrones aleatorios iluminan un objeto, una cámara fotografía cada uno de ellos y un algoritmo recupera cómo depende cada píxel de cada punto de la luz. Aquí todo ocurre en su navegador: no se envía nada.',
  photographs: 'Fotografías',
  source: 'Fotografías',
  'source.simulated': 'Un objeto simulado',
  'source.own': 'Una captura propia',
  'simulated.help':
    'El objeto es una fórmula, así que su verdadero transporte de luz se conoce: la página puede decir si la recuperación es buena. Después de la primera, cada cambio inicia otra.',
  patterns: 'Patrones',
  object: 'Objeto',
  'object.glass': 'Vidriera',
  'object.cookies': 'Galletas en una bandeja',
  size: 'Píxeles, elementos de luz',
  ensemble: 'Valores de los patrones',
  'ensemble.gaussian': 'Gauss',
  'ensemble.bernoulli': 'Bernoulli: encendido o apagado',
  noise: 'Ruido de la cámara',
  'noise.low': 'bajo',
  'noise.usual': 'habitual',
  'noise.high': 'alto',
  method: 'Método',
  'method.learned': 'Distribución aprendida',
  more: 'Más ajustes',
  window: 'Ventana',
  'window.auto': 'estimada',
  'own.help':
    'Una carpeta de captura contiene capture.json, patrones y fotografías lineales de 16 bits.',
  'own.guide': 'Cómo hacer una (en inglés)',
  'own.drop': 'Suelte aquí una carpeta de captura o su archivo zip, o',
  'own.folder': 'Elegir una carpeta',
  'own.zip': 'Elegir un archivo zip',
  recover: 'Recuperar',
  sweep: 'Recuperar con 5 a 160 patrones',
  cancel: 'Cancelar',
  accuracy: 'Precisión',
  'accuracy.help':
    'La SNR compara el transporte recuperado con el verdadero, en todos sus elementos: 20 dB significan un error de una décima parte. Cada recuperación añade un punto.',
  table: 'Como tabla',
  result: 'La fotografía recuperada',
  save: 'Guardar el archivo .ltm',
  light: 'Bajo una luz',
  'light.help':
    'Mueva la luz sobre una imagen o con los controles. Todas las imágenes de esta página la siguen.',
  'light.true': 'Verdadera',
  'light.recovered': 'Recuperada',
  'light.error': 'Diferencia; el blanco es una décima parte del valor más claro',
  'light.x': 'Luz de izquierda a derecha',
  'light.y': 'Luz de arriba abajo',
  'light.size': 'Tamaño de la luz',
  function: 'La función de transporte de luz de un píxel',
  'function.help':
    'Cuánta luz recibe el píxel del centro de la luz de cada elemento de luz. Solo cuentan los elementos de una pequeña ventana a su alrededor; el dibujo la muestra en el plano de luz.',
  'function.window': 'La ventana en el plano de luz',
  scattering: 'La función de dispersión de un elemento de luz',
  'scattering.help':
    'La imagen cuando solo está encendido el elemento de luz detrás de ese píxel, aclarada.',
  structure: 'La matriz de transporte de luz',
  band: 'La banda',
  'band.help':
    'Los píxeles de izquierda a derecha y los elementos de luz de arriba abajo, fila por fila. Toda la luz está en una banda estrecha, porque en el objeto recorre poco camino: por eso bastan tan pocas fotografías.',
  singular: 'Los valores singulares',
  'singular.help':
    'Bajan despacio, así que la matriz no tiene un rango bajo: los métodos que lo necesitan requerirían muchas más fotografías.',
  'job.simulating': 'Simulando las fotografías',
  'job.reading': 'Leyendo la captura',
  'job.preparing': 'Aprendiendo de todas las fotografías',
  'job.recovering': 'Recuperando el transporte',
  'job.encoding': 'Escribiendo el archivo',
  'job.left': 'quedan {seconds} s',
  'job.cancelled': 'Cancelado.',
  'job.hidden':
    'La pestaña está oculta, así que el navegador puede frenar el trabajo; sigue cuando usted vuelve.',
  'done.simulated': 'Recuperado de {patterns} patrones en {seconds} s: SNR {snr} dB.',
  'done.own': 'Recuperado de {patterns} fotografías en {seconds} s.',
  'done.file': 'El archivo ocupa {size} MB.',
  'fact.size': '{width} × {height} píxeles, {lightWidth} × {lightHeight} elementos de luz',
  'fact.patterns': '{patterns} patrones',
  'fact.window': 'ventana {window} × {window}',
  'fact.rank': 'rango {rank}',
  'fact.snr': 'SNR {snr} dB frente al transporte verdadero',
  'fact.expected': 'SNR {snr} dB esperada',
  'fact.heldOut': 'SNR {snr} dB en imágenes no usadas',
  'own.files': '{name}: {files} archivos',
  'own.estimate': 'La recuperación necesita unos {memory} MB de memoria y {seconds} s.',
  'point.text':
    'Píxel {x}, {y} y elemento de luz {u}, {v}: el 90\u00a0% de su luz viene de {elements} de los {all} elementos de la ventana.',
  'point.snr': 'Las imágenes bajo esta luz: SNR {snr} dB.',
  'picture.true': 'Imagen verdadera bajo una mancha de luz en {x} %, {y} %',
  'picture.recovered': 'Imagen recuperada bajo una mancha de luz en {x} %, {y} %',
  'picture.error': 'Diferencia de las dos imágenes: SNR {snr} dB',
  'function.true': 'Función de transporte verdadera del píxel {x}, {y}',
  'function.recovered': 'Función de transporte recuperada del píxel {x}, {y}',
  'window.map':
    'Plano de luz de {width} × {height} elementos; la ventana de {window} × {window} elementos empieza en {u}, {v}',
  'scattering.true': 'Imagen verdadera cuando solo está encendido el elemento de luz {u}, {v}',
  'scattering.recovered':
    'Imagen recuperada cuando solo está encendido el elemento de luz {u}, {v}',
  'band.label':
    'La matriz con {pixels} píxeles y {elements} elementos de luz: franjas diagonales claras sobre negro',
  'snr.axis': 'SNR en dB',
  'snr.label': 'SNR según el número de patrones: {points}',
  'snr.point': '{patterns} patrones: {snr} dB',
  'singular.axis': 'respecto al mayor',
  'singular.number': 'número',
  'singular.label': 'Valores singulares respecto al mayor: el del medio {middle}, el último {last}',
  'singular.block': 'Mostrados para los {width} × {height} elementos de luz del centro.',
  'singular.all':
    'Mostrados para todos los {width} × {height} elementos de luz y los tres canales.',
  'fault.code': 'Código: {code}',
  'source.camera': 'Su cámara y una segunda pantalla',
  'camera.help':
    'Ponga algo translúcido cerca de una segunda pantalla, por ejemplo vidrio de color o una hoja, apunte la cámara hacia ello y oscurezca la sala. La página muestra patrones en esa pantalla y fotografía cada uno; nada se envía. El vídeo tiene 8 bits y está procesado: los archivos sin procesar de una cámara de verdad son mucho más precisos. El SNR en imágenes no usadas dice cuánto vale el resultado.',
  'camera.start': 'Iniciar la cámara',
  'camera.window': 'Abrir la ventana de patrones',
  'camera.window.help':
    'Mueva la ventana de patrones a la segunda pantalla y haga clic en ella: entonces la llena. Su cuadrado blanco debe llenar casi toda la imagen de abajo, recto y visto de frente.',
  'camera.device': 'Cámara',
  'camera.photograph': 'Fotografiar todos los patrones',
  'camera.save': 'Guardar las fotografías',
  'job.photographing': 'Se fotografían los patrones',
  'camera.started': 'La cámara funciona.',
  'camera.title': 'Fotografiado en un navegador',
  'camera.window.title': 'Patrones',
  'camera.window.opened': 'La ventana de patrones está abierta.',
  'camera.paused':
    'En pausa, porque esta pestaña o la ventana de patrones está oculta; las fotografías siguen cuando ambas son visibles.',
  'camera.noise':
    'Ruido de un fotograma: {noise} % de la escala completa. Cada fotografía es la media de al menos {frames} fotogramas.',
  'camera.unlocked':
    'El navegador no pudo fijar esto: {settings}. Si cambia entretanto, el resultado es menos preciso.',
  'camera.exposure': 'exposición',
  'camera.focus': 'enfoque',
  'camera.whiteBalance': 'balance de blancos',
  'camera.kept':
    'Se conservan las fotografías de {patterns} patrones: recupere a partir de ellas o fotografíe de nuevo.',
  'camera.done': 'Se tomaron {photographs} fotografías.',
  'fault.camera-unsupported':
    'Este navegador no da una cámara a la página. Use un navegador actual y abra la página por https.',
  'fault.camera-refused':
    'La página no puede usar la cámara. Permítalo en los ajustes del navegador para esta página e inicie la cámara de nuevo.',
  'fault.camera-missing': 'No se encontró ninguna cámara. Conecte una e iníciela de nuevo.',
  'fault.camera-busy':
    'La cámara no da imagen. Cierre otros programas que la usen e iníciela de nuevo.',
  'fault.camera-lost': 'La cámara ha desaparecido. Conéctela e iníciela de nuevo.',
  'fault.camera-saturated':
    'Con toda la luz, el {percent} % de la imagen es demasiado claro para la cámara. Oscurezca la segunda pantalla o use otra cámara.',
  'fault.camera-no-signal':
    'La imagen de la cámara no cambia con los patrones. Apunte la cámara a la segunda pantalla y mantenga visible allí la ventana de patrones.',
  'fault.camera-unstable':
    'La imagen de la cámara nunca está quieta. Fije la cámara y el objeto y aleje otra luz.',
  'fault.patterns-blocked':
    'El navegador ha bloqueado la ventana de patrones. Permita las ventanas emergentes para esta página y ábrala de nuevo.',
  'fault.patterns-closed': 'La ventana de patrones está cerrada. Ábrala de nuevo.',
  'fault.simulation-unavailable':
    'No se pudo cargar la simulación: {reason}. Compruebe la conexión e inténtelo de nuevo.',
};
