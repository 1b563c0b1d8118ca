// The demo as a part of a page of the site.

import {begin} from './demo.js';
import {showPin} from './opening.js';

begin().then((demo) => demo && showPin(demo));
