/** All browser tests, in one process, as they share one Chromium and one server. */

import './serving.js';
import './transfer.js';
import './relighting.js';
import './crew.js';
import './torch.js';
import './visitors.js';
import './states.js';
import './posters.js';
import './accessibility.js';
import './light-sources.js';
import './sight.js';
import './quality.js';
import './fallback.js';
import './devices.js';
import './faults.js';
import './lifetime.js';
import './robustness.js';
import './visual.js';
import './page.js';
import './site.js';
