/** Français. */

export default {
  title: 'Reconstruire',
  language: 'Langue',
  lead: 'Des motifs aléatoires éclairent un objet, un appareil photographie chacun d’eux, et un solveur reconstruit comment chaque pixel dépend de chaque point de la lumière. Ici tout se passe dans votre navigateur : rien n’est envoyé.',
  photographs: 'Photographies',
  source: 'Photographies',
  'source.simulated': 'Un objet simulé',
  'source.own': 'Votre propre prise de vue',
  'simulated.help':
    'L’objet est une formule, son vrai transport de la lumière est donc connu : la page peut dire si la reconstruction est bonne. Après la première, chaque changement en lance une autre.',
  patterns: 'Motifs',
  object: 'Objet',
  'object.glass': 'Vitrail',
  'object.cookies': 'Biscuits sur un plateau',
  size: 'Pixels, éléments lumineux',
  ensemble: 'Valeurs des motifs',
  'ensemble.gaussian': 'Gauss',
  'ensemble.bernoulli': 'Bernoulli : allumé ou éteint',
  noise: 'Bruit de l’appareil',
  'noise.low': 'faible',
  'noise.usual': 'habituel',
  'noise.high': 'fort',
  method: 'Méthode',
  'method.learned': 'A priori appris',
  more: 'Autres réglages',
  window: 'Fenêtre',
  'window.auto': 'estimée',
  'own.help':
    'Un dossier de prise de vue contient capture.json, des motifs et des photographies linéaires de 16 bits.',
  'own.guide': 'Comment en faire un (en anglais)',
  'own.drop': 'Déposez ici un dossier de prise de vue ou son fichier zip, ou',
  'own.folder': 'Choisir un dossier',
  'own.zip': 'Choisir un fichier zip',
  recover: 'Reconstruire',
  sweep: 'Reconstruire avec 5 à 160 motifs',
  cancel: 'Annuler',
  accuracy: 'Précision',
  'accuracy.help':
    'Le SNR compare le transport reconstruit au vrai, sur tous ses éléments : 20 dB signifient une erreur d’un dixième. Chaque reconstruction ajoute un point.',
  table: 'En tableau',
  result: 'La photographie reconstruite',
  save: 'Enregistrer le fichier .ltm',
  light: 'Sous une lumière',
  'light.help':
    'Déplacez la lumière sur une image ou avec les curseurs. Toutes les images de cette page suivent.',
  'light.true': 'Vraie',
  'light.recovered': 'Reconstruite',
  'light.error': 'Différence ; le blanc est un dixième de la valeur la plus claire',
  'light.x': 'Lumière de gauche à droite',
  'light.y': 'Lumière de haut en bas',
  'light.size': 'Taille de la lumière',
  function: 'La fonction de transport de la lumière d’un pixel',
  'function.help':
    'Combien de lumière le pixel au centre de la lumière reçoit de chaque élément lumineux. Seuls comptent les éléments d’une petite fenêtre autour de lui ; le dessin la montre sur le plan lumineux.',
  'function.window': 'La fenêtre sur le plan lumineux',
  scattering: 'La fonction de diffusion d’un élément lumineux',
  'scattering.help':
    'L’image quand seul l’élément lumineux derrière ce pixel est allumé, éclaircie.',
  structure: 'La matrice de transport de la lumière',
  band: 'La bande',
  'band.help':
    'Les pixels de gauche à droite, les éléments lumineux de haut en bas, ligne par ligne. Toute la lumière est dans une bande étroite, car elle ne parcourt que peu de chemin dans l’objet : si peu de photographies suffisent donc.',
  singular: 'Les valeurs singulières',
  'singular.help':
    'Elles baissent lentement, la matrice n’a donc pas un rang faible : les méthodes qui en ont besoin demanderaient bien plus de photographies.',
  'job.simulating': 'Simulation des photographies',
  'job.reading': 'Lecture de la prise de vue',
  'job.preparing': 'Apprentissage sur toutes les photographies',
  'job.recovering': 'Reconstruction du transport',
  'job.encoding': 'Écriture du fichier',
  'job.left': 'encore {seconds} s',
  'job.cancelled': 'Annulé.',
  'job.hidden':
    'L’onglet est caché, le navigateur peut ralentir le travail ; il continue quand vous revenez.',
  'done.simulated': 'Reconstruit à partir de {patterns} motifs en {seconds} s : SNR {snr} dB.',
  'done.own': 'Reconstruit à partir de {patterns} photographies en {seconds} s.',
  'done.file': 'Le fichier fait {size} Mo.',
  'fact.size': '{width} × {height} pixels, {lightWidth} × {lightHeight} éléments lumineux',
  'fact.patterns': '{patterns} motifs',
  'fact.window': 'fenêtre {window} × {window}',
  'fact.rank': 'rang {rank}',
  'fact.snr': 'SNR {snr} dB par rapport au vrai transport',
  'fact.expected': 'SNR {snr} dB attendu',
  'fact.heldOut': 'SNR {snr} dB sur des images non utilisées',
  'own.files': '{name} : {files} fichiers',
  'own.estimate': 'La reconstruction prend environ {memory} Mo de mémoire et {seconds} s.',
  'point.text':
    'Pixel {x}, {y} et élément lumineux {u}, {v} : 90\u00a0% de sa lumière vient de {elements} des {all} éléments de la fenêtre.',
  'point.snr': 'Les images sous cette lumière : SNR {snr} dB.',
  'picture.true': 'Vraie image sous une tache de lumière à {x} %, {y} %',
  'picture.recovered': 'Image reconstruite sous une tache de lumière à {x} %, {y} %',
  'picture.error': 'Différence des deux images : SNR {snr} dB',
  'function.true': 'Vraie fonction de transport du pixel {x}, {y}',
  'function.recovered': 'Fonction de transport reconstruite du pixel {x}, {y}',
  'window.map':
    'Plan lumineux de {width} × {height} éléments ; la fenêtre de {window} × {window} éléments commence à {u}, {v}',
  'scattering.true': 'Vraie image quand seul l’élément lumineux {u}, {v} est allumé',
  'scattering.recovered': 'Image reconstruite quand seul l’élément lumineux {u}, {v} est allumé',
  'band.label':
    'La matrice de {pixels} pixels et {elements} éléments lumineux : des raies diagonales claires sur fond noir',
  'snr.axis': 'SNR en dB',
  'snr.label': 'SNR selon le nombre de motifs : {points}',
  'snr.point': '{patterns} motifs : {snr} dB',
  'singular.axis': 'par rapport à la plus grande',
  'singular.number': 'numéro',
  'singular.label':
    'Valeurs singulières par rapport à la plus grande : celle du milieu {middle}, la dernière {last}',
  'singular.block': 'Montrées pour les {width} × {height} éléments lumineux du milieu.',
  'singular.all':
    'Montrées pour tous les {width} × {height} éléments lumineux et les trois canaux.',
  'fault.code': 'Code : {code}',
  'source.camera': 'Votre caméra et un second écran',
  'camera.help':
    'Placez un objet translucide tout près d’un second écran, par exemple du verre coloré ou une feuille, dirigez-y la caméra et faites le noir dans la pièce. La page affiche des motifs sur cet écran et photographie chacun d’eux ; rien n’est envoyé. La vidéo n’a que 8 bits et est traitée : les fichiers bruts d’un véritable appareil sont bien plus précis. Le SNR sur des images non utilisées dit ce que vaut le résultat.',
  'camera.start': 'Démarrer la caméra',
  'camera.window': 'Ouvrir la fenêtre des motifs',
  'camera.window.help':
    'Déplacez la fenêtre des motifs sur le second écran et cliquez dessus : elle le remplit alors. Son carré blanc doit presque remplir l’image ci-dessous, droit et vu de face.',
  'camera.device': 'Caméra',
  'camera.photograph': 'Photographier tous les motifs',
  'camera.save': 'Enregistrer les photographies',
  'job.photographing': 'Les motifs sont photographiés',
  'camera.started': 'La caméra fonctionne.',
  'camera.title': 'Photographié dans un navigateur',
  'camera.window.title': 'Motifs',
  'camera.window.opened': 'La fenêtre des motifs est ouverte.',
  'camera.paused':
    'En pause, car cet onglet ou la fenêtre des motifs est masqué ; les photographies reprennent quand les deux sont visibles.',
  'camera.noise':
    'Bruit d’une image : {noise} % de la pleine échelle. Chaque photographie est la moyenne d’au moins {frames} images.',
  'camera.unlocked':
    'Le navigateur n’a pas pu fixer ceci : {settings}. Si cela change entre-temps, le résultat est moins précis.',
  'camera.exposure': 'exposition',
  'camera.focus': 'mise au point',
  'camera.whiteBalance': 'balance des blancs',
  'camera.kept':
    'Les photographies de {patterns} motifs sont gardées : calculez avec elles, ou photographiez de nouveau.',
  'camera.done': '{photographs} photographies ont été prises.',
  'fault.camera-unsupported':
    'Ce navigateur ne donne pas de caméra à la page. Prenez un navigateur récent et ouvrez la page par https.',
  'fault.camera-refused':
    'La page n’a pas le droit d’utiliser la caméra. Autorisez-la dans les réglages du navigateur pour cette page, puis redémarrez la caméra.',
  'fault.camera-missing': 'Aucune caméra n’a été trouvée. Branchez-en une et redémarrez-la.',
  'fault.camera-busy':
    'La caméra ne donne pas d’image. Fermez les autres programmes qui l’utilisent et redémarrez-la.',
  'fault.camera-lost': 'La caméra a disparu. Rebranchez-la et redémarrez-la.',
  'fault.camera-saturated':
    'En pleine lumière, {percent} % de l’image est trop clair pour la caméra. Assombrissez le second écran ou prenez une autre caméra.',
  'fault.camera-no-signal':
    'L’image de la caméra ne change pas avec les motifs. Dirigez la caméra vers le second écran et gardez-y la fenêtre des motifs visible.',
  'fault.camera-unstable':
    'L’image de la caméra n’est jamais stable. Fixez la caméra et l’objet, et éliminez toute autre lumière.',
  'fault.patterns-blocked':
    'Le navigateur a bloqué la fenêtre des motifs. Autorisez les fenêtres surgissantes pour cette page et ouvrez-la de nouveau.',
  'fault.patterns-closed': 'La fenêtre des motifs est fermée. Ouvrez-la de nouveau.',
  'fault.simulation-unavailable':
    'La simulation n’a pas pu être chargée : {reason}. Vérifiez la connexion et réessayez.',
};
