// The linter of the page of `iccm edit` and of the demo: `make lint`.

import js from '@eslint/js';
import globals from 'globals';

export default [
  js.configs.recommended,
  {
    files: ['io/edit/page/**/*.js', 'web/**/*.js', 'plugins/figma/**/*.js'],
    languageOptions: {globals: globals.browser},
  },
  {
    files: ['tests/io/edit/page/**/*.js', 'tests/web/**/*.js', 'tests/plugins/**/*.js', 'web/bundle.js'],
    languageOptions: {globals: globals.node},
  },
  {
    linterOptions: {reportUnusedDisableDirectives: 'error'},
    rules: {
      curly: ['error', 'multi-line', 'consistent'],
      eqeqeq: 'error',
      'no-implicit-coercion': 'error',
      'no-shadow': 'error',
      'no-var': 'error',
      'no-unused-expressions': 'error',
      'no-use-before-define': ['error', {functions: false, classes: false, variables: false}],
      'object-shorthand': 'error',
      'prefer-const': ['error', {destructuring: 'all'}],
    },
  },
];
