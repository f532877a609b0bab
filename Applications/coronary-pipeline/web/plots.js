// Measures over the phases: drawings that EvaluationPlots.cxx made.

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

/** The drawing of a measure, as it is in plots/, with a cursor at a phase of one case; a click goes to the phase. */
class Plot {
  /** @param plot  of the page's data @param index  of the case */
  constructor(plot, index, phases, onPhase) {
    this.key = plot.key;
    this.phases = phases;
    this.svg = document.importNode(new DOMParser().parseFromString(plot.svg, 'image/svg+xml').documentElement, true);
    const { frame, over, height } = this.svg.dataset;
    const [low, high, left, right, top, bottom] = frame.split(' ').map(Number);
    this.place = (phase) =>
      left + (right - left) * ((over === 'fraction' ? 100 * phase.fraction : phase.phase) - low) / (high - low);
    const width = this.svg.viewBox.baseVal.width;
    // Without the names of the cases: the others are pale.
    this.svg.setAttribute('viewBox', `0 0 ${width} ${height}`);
    this.cursor = drawing('line', { y1: top, y2: bottom, class: 'cursor' });
    this.value = drawing('text', { x: right, y: top - 11, class: 'value end' });
    const own = this.svg.querySelector(`[data-case="${index}"]`);
    if (own) {
      own.classList.add('here');
      this.svg.append(own); // over the others
    }
    this.svg.append(this.cursor, this.value);
    this.svg.addEventListener('click', (event) => {
      const box = this.svg.getBoundingClientRect();
      const x = (event.clientX - box.left) * width / box.width;
      const away = phases.map((phase) => Math.abs(this.place(phase) - x));
      onPhase(away.indexOf(Math.min(...away)));
    });
  }

  show(index) {
    const phase = this.phases[index];
    this.cursor.setAttribute('x1', this.place(phase));
    this.cursor.setAttribute('x2', this.place(phase));
    this.value.textContent = known(phase[this.key]) ? phase[this.key].toFixed(3) : '–';
  }
}

