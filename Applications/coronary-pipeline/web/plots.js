// Measures over the phases, as SVG.

const SVG = 'http://www.w3.org/2000/svg';

/** An element of SVG or, without a name space, of HTML; texts become texts, never markup. */
function element(name, attributes = {}, children = [], space = null) {
  const made = space ? document.createElementNS(space, name) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (value !== null && value !== undefined) {
      made.setAttribute(key, value);
    }
  }
  made.append(...children);
  return made;
}

function drawing(name, attributes, children) {
  return element(name, attributes, children, SVG);
}

/** "tracked", "interpolated" or "lost". */
function kindOf(phase) {
  return phase.lost ? 'lost' : phase.interpolated ? 'interpolated' : 'tracked';
}

function percentOf(phase) {
  return phase.fraction === null ? '' : `${(100 * phase.fraction).toFixed(1)} %R-R`;
}

function known(value) {
  return typeof value === 'number' && Number.isFinite(value);
}

/** Disc: tracked, diamond: interpolated, cross: lost. */
function markOf(kind, x, y, size) {
  if (kind === 'tracked') {
    return drawing('circle', { cx: x, cy: y, r: size, class: `mark ${kind}` });
  }
  const path = kind === 'interpolated'
    ? `M${x - 1.3 * size} ${y}L${x} ${y - 1.3 * size}L${x + 1.3 * size} ${y}L${x} ${y + 1.3 * size}Z`
    : `M${x - size} ${y - size}L${x + size} ${y + size}M${x - size} ${y + size}L${x + size} ${y - size}`;
  return drawing('path', { d: path, class: `mark ${kind}` });
}

/** Round values, at most six of them, that span both; values that are nearly one lie in the middle. */
function ticksOf(least, greatest) {
  const missing = Math.max(0, 0.01 - (greatest - least), 0.02 * Math.abs(greatest) - (greatest - least));
  least -= least >= 0 ? Math.min(least, missing / 2) : missing / 2;
  greatest += missing / 2;
  const rough = (greatest - least) / 4;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((factor) => factor * power >= rough);
  const ticks = [];
  for (let k = Math.floor(least / step + 1e-9); k <= Math.ceil(greatest / step - 1e-9); ++k) {
    ticks.push(k * step);
  }
  return { ticks, digits: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) };
}

const PLOT = { width: 340, height: 190, left: 46, right: 12, top: 26, bottom: 30 };

/** One measure of a case over its phases; a click goes to the phase. */
class Plot {
  /**
   * @param order   indices of phases, as they follow each other
   * @param paper   the paper's mean over interpolated phases, or null
   */
  constructor(column, phases, order, paper, onPhase) {
    this.places = new Map();
    const values = order.map((index) => phases[index][column.key]);
    const present = values.filter(known).concat(known(paper) ? [paper] : []);
    const { ticks, digits } = ticksOf(Math.min(...present), Math.max(...present));
    const [low, high] = [ticks[0], ticks[ticks.length - 1]];
    const inner = { width: PLOT.width - PLOT.left - PLOT.right, height: PLOT.height - PLOT.top - PLOT.bottom };
    const x = (place) => PLOT.left + inner.width * (order.length > 1 ? place / (order.length - 1) : 0.5);
    const y = (value) => PLOT.top + inner.height * (1 - (value - low) / (high - low || 1));
    order.forEach((index, place) => this.places.set(index, x(place)));

    const parts = [];
    for (const tick of ticks) {
      parts.push(drawing('line', { x1: PLOT.left, x2: PLOT.width - PLOT.right, y1: y(tick), y2: y(tick), class: 'grid' }));
      parts.push(drawing('text', { x: PLOT.left - 6, y: y(tick) + 3.5, class: 'tick end' }, [tick.toFixed(digits)]));
    }
    const every = Math.ceil(order.length / 6);
    order.forEach((index, place) => {
      if (place % every === 0) {
        const fraction = phases[index].fraction;
        const text = fraction === null ? `${phases[index].phase}` : (100 * fraction).toFixed(0);
        parts.push(drawing('text', { x: x(place), y: PLOT.height - 14, class: 'tick middle' }, [text]));
      }
    });
    parts.push(drawing('text', { x: PLOT.width - PLOT.right, y: PLOT.height - 2, class: 'tick end' },
      [phases.every((phase) => phase.fraction !== null) ? '%R-R' : 'phase']));
    parts.push(drawing('text', { x: PLOT.left, y: 14, class: 'title' },
      [column.unit ? `${column.key} (${column.unit})` : column.key]));
    if (known(paper)) {
      parts.push(drawing('line', { x1: PLOT.left, x2: PLOT.width - PLOT.right, y1: y(paper), y2: y(paper), class: 'paper' }));
    }
    this.cursor = drawing('line', { y1: PLOT.top, y2: PLOT.height - PLOT.bottom, class: 'cursor' });
    this.value = drawing('text', { x: PLOT.width - PLOT.right, y: 14, class: 'value end' });
    let path = '';
    let pen = 'M';
    values.forEach((value, place) => {
      path += known(value) ? `${pen}${x(place)} ${y(value)}` : '';
      pen = known(value) ? 'L' : 'M';
    });
    parts.push(this.cursor, drawing('path', { d: path, class: 'curve' }), this.value);
    values.forEach((value, place) => {
      if (known(value)) {
        parts.push(markOf(kindOf(phases[order[place]]), x(place), y(value), 3.2));
      }
    });
    this.key = column.key;
    this.phases = phases;
    this.svg = drawing('svg', { viewBox: `0 0 ${PLOT.width} ${PLOT.height}`, class: 'plot', role: 'img',
      'aria-label': `${column.key} over the phases` }, parts);
    this.svg.addEventListener('click', (event) => {
      const box = this.svg.getBoundingClientRect();
      const place = ((event.clientX - box.left) * PLOT.width / box.width - PLOT.left) / inner.width;
      onPhase(order[Math.max(0, Math.min(order.length - 1, Math.round(place * (order.length - 1))))]);
    });
  }

  show(index) {
    this.cursor.setAttribute('x1', this.places.get(index));
    this.cursor.setAttribute('x2', this.places.get(index));
    const value = this.phases[index][this.key];
    this.value.textContent = known(value) ? value.toFixed(3) : '–';
  }
}

