// The steps that can be undone, in words.

/** What a step changed, from one scene to the next. */
export function change(before, after) {
  if (!before) return 'as it began';
  for (const [kind, word, made] of [['pins', 'pin', 'placed'], ['strokes', 'stroke', 'drawn']]) {
    const more = after[kind].length - before[kind].length, count = Math.abs(more);
    if (more) return `${count === 1 ? word : `${count} ${word}s`} ${more > 0 ? made : 'removed'}`;
  }
  for (const name of ['balance', 'turn', 'fit']) if (before[name] !== after[name]) return `${name} ${after[name]}`;
  for (const [kind, word] of [['pins', 'pin'], ['strokes', 'stroke']]) {
    const other = after[kind].flatMap((entry, k) => (JSON.stringify(entry) === JSON.stringify(before[kind][k]) ? [] : [k]));
    if (other.length > 1) return `${other.length} ${word}s moved`;
    if (other.length) {
      const [now, then] = [after, before].map((scene) => scene[kind][other[0]]);
      return `${word} ${other[0] + 1} ${now.name !== then.name ? 'named' : now.turn !== then.turn ? 'turned' : 'moved'}`;
    }
  }
  return 'as before';
}

/** The steps as a list of buttons, the newest first; `go(number)` leads back or on to one. */
export function past(element, history, present, go) {
  const scenes = history.map((text) => JSON.parse(text));
  element.replaceChildren(...scenes.map((scene, k) => {
    const item = document.createElement('li'), button = item.appendChild(document.createElement('button'));
    button.textContent = change(scenes[k - 1], scene);
    if (k === present) button.setAttribute('aria-current', 'step');
    button.onclick = () => go(k);
    return item;
  }).reverse());
}
