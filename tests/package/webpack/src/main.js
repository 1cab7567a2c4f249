import 'relightable-photo';
