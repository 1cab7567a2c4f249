/** All browser tests, in one process, as they share one Chromium and one server. */

import './serving.js';
import './transfer.js';
import './relighting.js';
import './torch.js';
import './fallback.js';
import './faults.js';
import './lifetime.js';
import './page.js';
