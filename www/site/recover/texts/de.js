/** Deutsch. */

export default {
  title: 'Wiederherstellen',
  language: 'Sprache',
  lead: 'Zufallsmuster beleuchten ein Objekt, eine Kamera fotografiert jedes davon, und ein Löser stellt wieder her, wie jedes Pixel von jedem Punkt des Lichts abhängt. Hier läuft alles in Ihrem Browser: Nichts wird gesendet.',
  photographs: 'Fotografien',
  source: 'Fotografien',
  'source.simulated': 'Ein simuliertes Objekt',
  'source.own': 'Ihre eigene Aufnahme',
  'simulated.help':
    'Das Objekt ist eine Formel, sein wahrer Lichttransport ist also bekannt: Die Seite kann sagen, wie gut die Wiederherstellung ist. Nach der ersten beginnt jede Änderung eine neue.',
  patterns: 'Muster',
  object: 'Objekt',
  'object.glass': 'Glasfenster',
  'object.cookies': 'Kekse auf einem Blech',
  size: 'Pixel, Lichtelemente',
  ensemble: 'Werte der Muster',
  'ensemble.gaussian': 'Gauß',
  'ensemble.bernoulli': 'Bernoulli: an oder aus',
  noise: 'Rauschen der Kamera',
  'noise.low': 'wenig',
  'noise.usual': 'üblich',
  'noise.high': 'viel',
  method: 'Verfahren',
  'method.learned': 'Gelernter Prior',
  more: 'Weitere Einstellungen',
  window: 'Fenster',
  'window.auto': 'geschätzt',
  'own.help': 'Ein Aufnahmeordner enthält capture.json, Muster und lineare 16-Bit-Fotografien.',
  'own.guide': 'So wird einer aufgenommen (englisch)',
  'own.drop': 'Legen Sie hier einen Aufnahmeordner oder dessen Zip-Datei ab, oder',
  'own.folder': 'Ordner wählen',
  'own.zip': 'Zip-Datei wählen',
  recover: 'Wiederherstellen',
  sweep: 'Mit 5 bis 160 Mustern wiederherstellen',
  cancel: 'Abbrechen',
  accuracy: 'Genauigkeit',
  'accuracy.help':
    'Das SNR vergleicht den wiederhergestellten mit dem wahren Transport, über alle Elemente: 20 dB bedeuten einen Fehler von einem Zehntel. Jede Wiederherstellung fügt einen Punkt hinzu.',
  table: 'Als Tabelle',
  result: 'Die wiederhergestellte Fotografie',
  save: '.ltm-Datei speichern',
  light: 'Unter einem Licht',
  'light.help':
    'Bewegen Sie das Licht über ein Bild oder mit den Reglern. Alle Bilder dieser Seite folgen.',
  'light.true': 'Wahr',
  'light.recovered': 'Wiederhergestellt',
  'light.error': 'Differenz; Weiß ist ein Zehntel des hellsten Werts',
  'light.x': 'Licht von links nach rechts',
  'light.y': 'Licht von oben nach unten',
  'light.size': 'Größe des Lichts',
  function: 'Die Lichttransportfunktion eines Pixels',
  'function.help':
    'Wie viel Licht das Pixel in der Mitte des Lichts von jedem Lichtelement erhält. Nur Elemente in einem kleinen Fenster darum zählen; die Zeichnung zeigt das Fenster auf der Lichtebene.',
  'function.window': 'Das Fenster auf der Lichtebene',
  scattering: 'Die Punktstreufunktion eines Lichtelements',
  'scattering.help':
    'Das Bild, wenn nur das Lichtelement hinter diesem Pixel leuchtet, aufgehellt.',
  structure: 'Die Lichttransportmatrix',
  band: 'Das Band',
  'band.help':
    'Kamerapixel von links nach rechts, Lichtelemente von oben nach unten, beide zeilenweise. Alles Licht liegt in einem schmalen Band, denn es legt im Objekt nur kurze Wege zurück: Darum genügen so wenige Fotografien.',
  singular: 'Die Singulärwerte',
  'singular.help':
    'Sie fallen langsam, die Matrix hat also keinen kleinen Rang: Verfahren, die einen brauchen, kämen nur mit weit mehr Fotografien aus.',
  'job.simulating': 'Die Fotografien werden simuliert',
  'job.reading': 'Die Aufnahme wird gelesen',
  'job.preparing': 'Aus allen Fotografien wird gelernt',
  'job.recovering': 'Der Transport wird wiederhergestellt',
  'job.encoding': 'Die Datei wird geschrieben',
  'job.left': 'noch {seconds} s',
  'job.cancelled': 'Abgebrochen.',
  'job.hidden':
    'Der Tab ist verborgen, darum kann der Browser die Arbeit bremsen; sie geht weiter, wenn Sie zurückkehren.',
  'done.simulated': 'Aus {patterns} Mustern in {seconds} s wiederhergestellt: SNR {snr} dB.',
  'done.own': 'Aus {patterns} Fotografien in {seconds} s wiederhergestellt.',
  'done.file': 'Die Datei hat {size} MB.',
  'fact.size': '{width} × {height} Pixel, {lightWidth} × {lightHeight} Lichtelemente',
  'fact.patterns': '{patterns} Muster',
  'fact.window': 'Fenster {window} × {window}',
  'fact.rank': 'Rang {rank}',
  'fact.snr': 'SNR {snr} dB gegen den wahren Transport',
  'fact.expected': 'SNR {snr} dB erwartet',
  'fact.heldOut': 'SNR {snr} dB auf Bildern, die nicht verwendet wurden',
  'own.files': '{name}: {files} Dateien',
  'own.estimate': 'Die Wiederherstellung braucht etwa {memory} MB Speicher und {seconds} s.',
  'point.text':
    'Pixel {x}, {y} und Lichtelement {u}, {v}: 90\u00a0% seines Lichts kommen von {elements} der {all} Elemente des Fensters.',
  'point.snr': 'Die Bilder unter diesem Licht: SNR {snr} dB.',
  'picture.true': 'Wahres Bild unter einem Lichtfleck bei {x} %, {y} %',
  'picture.recovered': 'Wiederhergestelltes Bild unter einem Lichtfleck bei {x} %, {y} %',
  'picture.error': 'Differenz der beiden Bilder: SNR {snr} dB',
  'function.true': 'Wahre Lichttransportfunktion von Pixel {x}, {y}',
  'function.recovered': 'Wiederhergestellte Lichttransportfunktion von Pixel {x}, {y}',
  'window.map':
    'Lichtebene mit {width} × {height} Elementen; das Fenster mit {window} × {window} Elementen beginnt bei {u}, {v}',
  'scattering.true': 'Wahres Bild, wenn nur Lichtelement {u}, {v} leuchtet',
  'scattering.recovered': 'Wiederhergestelltes Bild, wenn nur Lichtelement {u}, {v} leuchtet',
  'band.label':
    'Die Matrix mit {pixels} Pixeln und {elements} Lichtelementen: helle diagonale Streifen auf Schwarz',
  'snr.axis': 'SNR in dB',
  'snr.label': 'SNR nach der Zahl der Muster: {points}',
  'snr.point': '{patterns} Muster: {snr} dB',
  'singular.axis': 'relativ zum größten',
  'singular.number': 'Nummer',
  'singular.label': 'Singulärwerte relativ zum größten: der mittlere {middle}, der letzte {last}',
  'singular.block': 'Gezeigt für die {width} × {height} Lichtelemente in der Mitte.',
  'singular.all': 'Gezeigt für alle {width} × {height} Lichtelemente und alle drei Kanäle.',
  'fault.code': 'Code: {code}',
  'source.camera': 'Ihre Kamera und ein zweiter Bildschirm',
  'camera.help':
    'Stellen Sie etwas Durchscheinendes dicht vor einen zweiten Bildschirm, etwa farbiges Glas oder ein Blatt, richten Sie die Kamera darauf, und verdunkeln Sie den Raum. Die Seite zeigt dort Muster und fotografiert jedes davon; nichts wird gesendet. Video hat 8 Bit und ist verarbeitet, darum sind Rohdateien einer richtigen Kamera weit genauer: Das SNR auf Bildern, die nicht verwendet wurden, sagt, wie gut das Ergebnis ist.',
  'camera.start': 'Kamera starten',
  'camera.window': 'Musterfenster öffnen',
  'camera.window.help':
    'Schieben Sie das Musterfenster auf den zweiten Bildschirm und klicken Sie darauf: Dann füllt es ihn. Sein weißes Quadrat muss das Bild hier unten fast füllen, aufrecht und von vorn gesehen.',
  'camera.device': 'Kamera',
  'camera.photograph': 'Alle Muster fotografieren',
  'camera.save': 'Fotografien speichern',
  'job.photographing': 'Die Muster werden fotografiert',
  'camera.started': 'Die Kamera läuft.',
  'camera.title': 'In einem Browser fotografiert',
  'camera.window.title': 'Muster',
  'camera.window.opened': 'Das Musterfenster ist offen.',
  'camera.paused':
    'Angehalten, weil dieser Tab oder das Musterfenster verborgen ist; es geht weiter, sobald beide zu sehen sind.',
  'camera.noise':
    'Rauschen eines Einzelbilds: {noise} % des Höchstwerts. Jede Fotografie ist das Mittel von mindestens {frames} Einzelbildern.',
  'camera.unlocked':
    'Der Browser konnte das nicht festhalten: {settings}. Ändert es sich währenddessen, ist die Wiederherstellung weniger genau.',
  'camera.exposure': 'Belichtung',
  'camera.focus': 'Schärfe',
  'camera.whiteBalance': 'Weißabgleich',
  'camera.kept':
    'Die Fotografien von {patterns} Mustern bleiben: Stellen Sie daraus wieder her, oder fotografieren Sie noch einmal.',
  'camera.done': '{photographs} Fotografien wurden gemacht.',
  'fault.camera-unsupported':
    'Dieser Browser gibt der Seite keine Kamera. Nehmen Sie einen aktuellen Browser, und öffnen Sie die Seite über https.',
  'fault.camera-refused':
    'Die Seite darf die Kamera nicht benutzen. Erlauben Sie es in den Einstellungen des Browsers für diese Seite, und starten Sie die Kamera noch einmal.',
  'fault.camera-missing':
    'Es wurde keine Kamera gefunden. Schließen Sie eine an, und starten Sie sie noch einmal.',
  'fault.camera-busy':
    'Die Kamera liefert kein Bild. Schließen Sie andere Programme, die sie benutzen, und starten Sie sie noch einmal.',
  'fault.camera-lost':
    'Die Kamera ist verschwunden. Schließen Sie sie an, und starten Sie sie noch einmal.',
  'fault.camera-saturated':
    'Bei vollem Licht sind {percent} % des Bilds zu hell für die Kamera. Machen Sie den zweiten Bildschirm dunkler, oder nehmen Sie eine andere Kamera.',
  'fault.camera-no-signal':
    'Das Bild der Kamera ändert sich nicht mit den Mustern. Richten Sie die Kamera auf den zweiten Bildschirm, und lassen Sie das Musterfenster dort sichtbar.',
  'fault.camera-unstable':
    'Das Bild der Kamera steht nie still. Befestigen Sie Kamera und Objekt, und halten Sie anderes Licht fern.',
  'fault.patterns-blocked':
    'Der Browser hat das Musterfenster blockiert. Erlauben Sie dieser Seite neue Fenster, und öffnen Sie es noch einmal.',
  'fault.patterns-closed': 'Das Musterfenster ist geschlossen. Öffnen Sie es noch einmal.',
  'fault.simulation-unavailable':
    'Die Simulation konnte nicht geladen werden: {reason}. Prüfen Sie die Verbindung, und versuchen Sie es noch einmal.',
};
