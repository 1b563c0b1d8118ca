// The demo as a part of a page of the site.

import {begin} from './demo.js';

begin();
