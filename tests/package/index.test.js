/** All tests of the packed package, in one process, as they share the tarball and one Chromium. */

import './pack.js';
import './tools.js';
