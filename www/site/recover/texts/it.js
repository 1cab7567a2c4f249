/** Italiano. */

export default {
  title: 'Ricostruire',
  language: 'Lingua',
  lead: 'Motivi casuali illuminano un oggetto, una fotocamera li fotografa uno per uno e un solutore ricostruisce come ogni pixel dipende da ogni punto della luce. Qui tutto avviene nel browser: nulla viene inviato.',
  photographs: 'Fotografie',
  source: 'Fotografie',
  'source.simulated': 'Un oggetto simulato',
  'source.own': 'Una ripresa propria',
  'simulated.help':
    'L’oggetto è una formula, quindi il suo vero trasporto della luce è noto: la pagina può dire quanto è buona la ricostruzione. Dopo la prima, ogni modifica ne avvia un’altra.',
  patterns: 'Motivi',
  object: 'Oggetto',
  'object.glass': 'Vetrata',
  'object.cookies': 'Biscotti su un vassoio',
  size: 'Pixel, elementi luminosi',
  ensemble: 'Valori dei motivi',
  'ensemble.gaussian': 'Gauss',
  'ensemble.bernoulli': 'Bernoulli: acceso o spento',
  noise: 'Rumore della fotocamera',
  'noise.low': 'basso',
  'noise.usual': 'usuale',
  'noise.high': 'alto',
  method: 'Metodo',
  'method.learned': 'Prior appreso',
  more: 'Altre impostazioni',
  window: 'Finestra',
  'window.auto': 'stimata',
  'own.help':
    'Una cartella di ripresa contiene capture.json, i motivi e fotografie lineari a 16 bit.',
  'own.guide': 'Come farne una (in inglese)',
  'own.drop': 'Trascinare qui una cartella di ripresa o il suo file zip, oppure',
  'own.folder': 'Scegliere una cartella',
  'own.zip': 'Scegliere un file zip',
  recover: 'Ricostruire',
  sweep: 'Ricostruire con 5–160 motivi',
  cancel: 'Annullare',
  accuracy: 'Precisione',
  'accuracy.help':
    'L’SNR confronta il trasporto ricostruito con quello vero, su tutti gli elementi: 20 dB significano un errore di un decimo. Ogni ricostruzione aggiunge un punto.',
  table: 'Come tabella',
  result: 'La fotografia ricostruita',
  save: 'Salvare il file .ltm',
  light: 'Sotto una luce',
  'light.help':
    'Muovere la luce su un’immagine o con i cursori. Tutte le immagini di questa pagina la seguono.',
  'light.true': 'Vera',
  'light.recovered': 'Ricostruita',
  'light.error': 'Differenza; il bianco è un decimo del valore più chiaro',
  'light.x': 'Luce da sinistra a destra',
  'light.y': 'Luce dall’alto in basso',
  'light.size': 'Dimensione della luce',
  function: 'La funzione di trasporto della luce di un pixel',
  'function.help':
    'Quanta luce il pixel al centro della luce riceve da ogni elemento luminoso. Contano solo gli elementi di una piccola finestra intorno; il disegno la mostra sul piano luminoso.',
  'function.window': 'La finestra sul piano luminoso',
  scattering: 'La funzione di diffusione di un elemento luminoso',
  'scattering.help':
    'L’immagine quando è acceso solo l’elemento luminoso dietro quel pixel, schiarita.',
  structure: 'La matrice di trasporto della luce',
  band: 'La banda',
  'band.help':
    'I pixel da sinistra a destra, gli elementi luminosi dall’alto in basso, riga per riga. Tutta la luce sta in una banda stretta, perché nell’oggetto percorre poca strada: per questo bastano così poche fotografie.',
  singular: 'I valori singolari',
  'singular.help':
    'Calano lentamente, quindi la matrice non ha un rango basso: i metodi che ne hanno bisogno richiederebbero molte più fotografie.',
  'job.simulating': 'Simulazione delle fotografie',
  'job.reading': 'Lettura della ripresa',
  'job.preparing': 'Apprendimento da tutte le fotografie',
  'job.recovering': 'Ricostruzione del trasporto',
  'job.encoding': 'Scrittura del file',
  'job.left': 'ancora {seconds} s',
  'job.cancelled': 'Annullato.',
  'job.hidden':
    'La scheda è nascosta, quindi il browser può rallentare il lavoro; continua al ritorno.',
  'done.simulated': 'Ricostruito da {patterns} motivi in {seconds} s: SNR {snr} dB.',
  'done.own': 'Ricostruito da {patterns} fotografie in {seconds} s.',
  'done.file': 'Il file è di {size} MB.',
  'fact.size': '{width} × {height} pixel, {lightWidth} × {lightHeight} elementi luminosi',
  'fact.patterns': '{patterns} motivi',
  'fact.window': 'finestra {window} × {window}',
  'fact.rank': 'rango {rank}',
  'fact.snr': 'SNR {snr} dB rispetto al vero trasporto',
  'fact.expected': 'SNR {snr} dB atteso',
  'fact.heldOut': 'SNR {snr} dB su immagini non usate',
  'own.files': '{name}: {files} file',
  'own.estimate': 'La ricostruzione richiede circa {memory} MB di memoria e {seconds} s.',
  'point.text':
    'Pixel {x}, {y} ed elemento luminoso {u}, {v}: il 90\u00a0% della sua luce viene da {elements} dei {all} elementi della finestra.',
  'point.snr': 'Le immagini sotto questa luce: SNR {snr} dB.',
  'picture.true': 'Immagine vera sotto una macchia di luce a {x} %, {y} %',
  'picture.recovered': 'Immagine ricostruita sotto una macchia di luce a {x} %, {y} %',
  'picture.error': 'Differenza delle due immagini: SNR {snr} dB',
  'function.true': 'Vera funzione di trasporto del pixel {x}, {y}',
  'function.recovered': 'Funzione di trasporto ricostruita del pixel {x}, {y}',
  'window.map':
    'Piano luminoso di {width} × {height} elementi; la finestra di {window} × {window} elementi inizia a {u}, {v}',
  'scattering.true': 'Immagine vera quando è acceso solo l’elemento luminoso {u}, {v}',
  'scattering.recovered': 'Immagine ricostruita quando è acceso solo l’elemento luminoso {u}, {v}',
  'band.label':
    'La matrice con {pixels} pixel e {elements} elementi luminosi: strisce diagonali chiare su nero',
  'snr.axis': 'SNR in dB',
  'snr.label': 'SNR secondo il numero di motivi: {points}',
  'snr.point': '{patterns} motivi: {snr} dB',
  'singular.axis': 'rispetto al maggiore',
  'singular.number': 'numero',
  'singular.label':
    'Valori singolari rispetto al maggiore: quello di mezzo {middle}, l’ultimo {last}',
  'singular.block': 'Mostrati per i {width} × {height} elementi luminosi al centro.',
  'singular.all':
    'Mostrati per tutti i {width} × {height} elementi luminosi e tutti e tre i canali.',
  'fault.code': 'Codice: {code}',
  'source.camera': 'La vostra fotocamera e un secondo schermo',
  'camera.help':
    'Mettete qualcosa di traslucido vicino a un secondo schermo, per esempio vetro colorato o una foglia, puntate la fotocamera e oscurate la stanza. La pagina mostra motivi su quello schermo e fotografa ciascuno; nulla viene inviato. Il video ha 8 bit ed è elaborato: i file grezzi di una vera fotocamera sono molto più precisi. L’SNR su immagini non usate dice quanto vale il risultato.',
  'camera.start': 'Avviare la fotocamera',
  'camera.window': 'Aprire la finestra dei motivi',
  'camera.window.help':
    'Spostate la finestra dei motivi sul secondo schermo e fate clic: allora lo riempie. Il suo quadrato bianco deve quasi riempire l’immagine qui sotto, diritto e visto di fronte.',
  'camera.device': 'Fotocamera',
  'camera.photograph': 'Fotografare tutti i motivi',
  'camera.save': 'Salvare le fotografie',
  'job.photographing': 'I motivi vengono fotografati',
  'camera.started': 'La fotocamera è attiva.',
  'camera.title': 'Fotografato in un browser',
  'camera.window.title': 'Motivi',
  'camera.window.opened': 'La finestra dei motivi è aperta.',
  'camera.paused':
    'In pausa, perché questa scheda o la finestra dei motivi è nascosta; le fotografie proseguono quando entrambe sono visibili.',
  'camera.noise':
    'Rumore di un fotogramma: {noise} % del fondo scala. Ogni fotografia è la media di almeno {frames} fotogrammi.',
  'camera.unlocked':
    'Il browser non ha potuto fissare questo: {settings}. Se cambia nel frattempo, il risultato è meno preciso.',
  'camera.exposure': 'esposizione',
  'camera.focus': 'messa a fuoco',
  'camera.whiteBalance': 'bilanciamento del bianco',
  'camera.kept':
    'Le fotografie di {patterns} motivi restano: usatele per la ricostruzione, o fotografate di nuovo.',
  'camera.done': 'Sono state fatte {photographs} fotografie.',
  'fault.camera-unsupported':
    'Questo browser non dà una fotocamera alla pagina. Usate un browser aggiornato e aprite la pagina con https.',
  'fault.camera-refused':
    'La pagina non può usare la fotocamera. Permettetelo nelle impostazioni del browser per questa pagina e riavviate la fotocamera.',
  'fault.camera-missing': 'Non è stata trovata nessuna fotocamera. Collegatene una e riavviatela.',
  'fault.camera-busy':
    'La fotocamera non dà immagini. Chiudete gli altri programmi che la usano e riavviatela.',
  'fault.camera-lost': 'La fotocamera è scomparsa. Collegatela e riavviatela.',
  'fault.camera-saturated':
    'In piena luce il {percent} % dell’immagine è troppo chiaro per la fotocamera. Rendete più scuro il secondo schermo o usate un’altra fotocamera.',
  'fault.camera-no-signal':
    'L’immagine della fotocamera non cambia con i motivi. Puntate la fotocamera sul secondo schermo e tenetevi visibile la finestra dei motivi.',
  'fault.camera-unstable':
    'L’immagine della fotocamera non è mai ferma. Fissate fotocamera e oggetto e tenete lontana altra luce.',
  'fault.patterns-blocked':
    'Il browser ha bloccato la finestra dei motivi. Permettete le finestre popup per questa pagina e apritela di nuovo.',
  'fault.patterns-closed': 'La finestra dei motivi è chiusa. Apritela di nuovo.',
  'fault.simulation-unavailable':
    'La simulazione non è stata caricata: {reason}. Controlli la connessione e riprovi.',
};
