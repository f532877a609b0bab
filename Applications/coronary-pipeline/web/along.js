// Along a vessel: its cross-section at a slider, and its diameter over the heart cycle.

const CHART = { width: 720, narrow: 380, height: 190, left: 42, right: 8, top: 12, bottom: 26 };
const NARROW = 700; // CSS pixels of the window: below them charts are drawn narrower, so that their numbers stay readable
// Of the map: narrow is dark, wide is bright; seen apart also by those who do not see all colours (viridis).
const MAP_COLOURS = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];

/** A colour of the map for a share of its range, 0 to 1. */
function mapColour(share) {
  const at = Math.max(0, Math.min(1, share)) * (MAP_COLOURS.length - 1);
  const first = Math.min(MAP_COLOURS.length - 2, Math.floor(at));
  return MAP_COLOURS[first].map((part, k) => Math.round(part + (at - first) * (MAP_COLOURS[first + 1][k] - part)));
}

/** Cross-sections of a vessel, 1 mm apart, one at a time. */
class SectionView {
  /** @param sections  of the vessel's data @param observer  loads the picture @param onArc  called with the mm that the slider is moved to */
  constructor(vessel, observer, onArc) {
    this.sections = vessel.sections;
    const { half_width: half, count, across } = this.sections;
    this.image = element('img', { alt: '', 'data-picture': this.sections.picture, style: `width:${100 * across}%` });
    this.svg = drawing('svg', { viewBox: `${-half} ${-half} ${2 * half} ${2 * half}`, role: 'img', 'aria-label': `${vessel.name}, cross-section` }, []);
    this.picture = element('div', { class: 'section later' }, [this.image, this.svg]);
    this.slider = element('input', { type: 'range', min: 0, max: count - 1, step: 1, value: 0, 'aria-label': `Cross-section of ${vessel.name}, mm from its beginning` });
    this.values = element('p', { class: 'none' });
    this.title = element('strong');
    this.made = element('div', { class: 'across' }, [this.picture, element('div', {}, [
      element('label', {}, ['Cross-section at ', this.title, this.slider]), this.values])]);
    this.slider.addEventListener('input', () => {
      this.show(Number(this.slider.value));
      onArc(Number(this.slider.value));
    });
    observer.observe(this.picture);
    this.show(Math.min(count - 1, 10));
  }

  /** @param arc  mm from the vessel's beginning */
  show(arc) {
    const { across, rays, radius, edge, outer, edge_area: edgeArea, outer_area: outerArea, count } = this.sections;
    const k = Math.max(0, Math.min(count - 1, Math.round(arc)));
    this.slider.value = k;
    this.title.textContent = `${k} mm`;
    this.slider.setAttribute('aria-valuetext', `${k} mm`);
    this.image.style.left = `${-100 * (k % across)}%`;
    this.image.style.top = `${-100 * Math.floor(k / across)}%`;
    // From the upper side on, to the right: a boundary ends where it is not seen.
    const path = (distances) => {
      let text = '';
      for (let ray = 0; ray <= rays; ++ray) {
        const distance = distances[ray % rays];
        if (known(distance)) {
          const turn = 2 * Math.PI * ray / rays;
          const joined = ray > 0 && known(distances[ray - 1]);
          text += `${joined ? 'L' : 'M'}${(distance * Math.sin(turn)).toFixed(3)} ${(-distance * Math.cos(turn)).toFixed(3)}`;
        }
      }
      return text;
    };
    this.svg.replaceChildren(
      drawing('path', { d: path(outer[k]), class: 'outer' }), drawing('path', { d: path(edge[k]), class: 'edge' }),
      drawing('circle', { r: radius[k], class: 'lumen' }));
    const parts = [`lumen ${(2 * radius[k]).toFixed(1)} mm`];
    if (known(edgeArea[k])) {
      parts.push(`edge in the image ${edgeArea[k].toFixed(1)} mm²`);
    }
    parts.push(known(outerArea[k]) ? `within the outer boundary ${outerArea[k].toFixed(1)} mm²` : 'outer boundary not seen all around');
    this.values.textContent = parts.join('; ');
  }
}

// What is drawn over place and phase: name, unit, digits, and its value of a diameter (mm) and a degree (0 to 1).
const QUANTITIES = [
  { name: 'Diameter', unit: 'mm', digits: 1, of: (diameter) => diameter },
  { name: 'Area', unit: 'mm²', digits: 1, of: (diameter) => Math.PI / 4 * diameter * diameter },
  { name: 'Stenosis', unit: '%', digits: 0, of: (diameter, degree) => (known(degree) ? 100 * degree : null) },
];

/** Diameter, area or stenosis of a vessel at all phases: curves, and a map of place and phase. */
class CycleView {
  /** @param cycle  of the run @param index  of the vessel @param onArc  called with the mm that a click is at */
  constructor(cycle, index, onArc) {
    this.cycle = cycle;
    this.width = innerWidth < NARROW ? CHART.narrow : CHART.width;
    this.order = cycle.times.map((_, k) => k).sort((a, b) => cycle.times[a] - cycle.times[b]);
    this.vessel = cycle.vessels[index];
    this.count = this.vessel.diameter.length > 0 ? this.vessel.diameter[0].length : 0;
    this.empty = this.count < 2 || !this.vessel.diameter.flat().some(known);
    if (this.empty) {
      return;
    }
    this.chart = drawing('svg', { viewBox: `0 0 ${this.width} ${CHART.height}`, class: 'chart', role: 'img' }, []);
    this.line = drawing('path', { class: 'cursor' });
    this.map = element('canvas', { width: this.count, height: this.order.length, class: 'map', role: 'img' });
    this.reading = element('p', { class: 'none' });
    this.cursor = element('i', { class: 'cursor across', hidden: '' });
    this.scale = [element('span'), element('span')];
    const chooser = element('select', { 'aria-label': 'What is drawn' }, QUANTITIES.map((one, k) => element('option', { value: k }, [`${one.name} (${one.unit})`])));
    const rows = element('ol', { class: 'phases', style: `width:${100 * CHART.left / this.width}%` }, [...this.order].reverse().map((k) =>
      element('li', {}, [this.order.length <= 12 ? `${(100 * cycle.times[k]).toFixed(0)} %` : ''])));
    this.made = element('div', { class: 'cycle' }, [
      element('p', { class: 'legend cycle-legend' }, [chooser, element('span', { class: 'phase' }, ['each phase']), element('span', { class: 'now' }, ['the one shown']),
        element('span', { class: 'median' }, ['median']), element('span', { class: 'healthy' }, ['were it healthy'])]),
      this.chart, element('div', { class: 'mapped' }, [rows, element('div', { style: `margin-right:${100 * CHART.right / this.width}%` }, [this.map, this.cursor])]),
      element('p', { class: 'none scale-of-map' }, [this.scale[0], element('i', { style: `background:linear-gradient(to right, ${
        MAP_COLOURS.map((one) => `rgb(${one.join(' ')})`).join(', ')})` }), this.scale[1]]), this.reading]);
    this.choose(QUANTITIES[0]);
    chooser.addEventListener('change', () => this.choose(QUANTITIES[Number(chooser.value)]));
    this.chart.addEventListener('click', (event) => onArc(this.arcAt(this.chart, event, CHART.left / this.width, 1 - CHART.right / this.width)));
    this.map.addEventListener('click', (event) => {
      const box = this.map.getBoundingClientRect();
      const row = Math.floor((event.clientY - box.top) / box.height * this.order.length);
      const arc = this.arcAt(this.map, event, 0, 1);
      this.read(arc, this.order[this.order.length - 1 - Math.max(0, Math.min(this.order.length - 1, row))]);
      onArc(arc);
    });
  }

  /** Draws a quantity. */
  choose(quantity) {
    const { diameter, degree, median, healthy } = this.vessel;
    const of = (d, share) => (known(d) ? quantity.of(d, share) : null);
    const narrowed = (k) => (known(median[k]) && healthy[k] > 0 ? Math.max(0, 1 - median[k] / healthy[k]) : null);
    this.quantity = quantity;
    this.values = diameter.map((row, phase) => row.map((d, k) => of(d, degree[phase][k])));
    this.median = median.map((d, k) => of(d, narrowed(k)));
    this.healthy = healthy.map((d) => of(d, 0));
    const all = this.values.flat().filter(known);
    const drawn = [...all, ...this.healthy.filter(known)];
    const [low, high] = [Math.min(...all), Math.max(...all)];
    const spare = 0.08 * (Math.max(...drawn) - Math.min(...drawn) || 1);
    this.low = Math.max(0, Math.min(...drawn) - spare);
    this.high = Math.max(...drawn) + spare;
    this.draw();
    this.paint(low, high);
    this.scale[0].textContent = `${low.toFixed(quantity.digits)} ${quantity.unit}`;
    this.scale[1].textContent = `${high.toFixed(quantity.digits)} ${quantity.unit}; grey: not seen`;
    for (const one of [this.chart, this.map]) {
      one.setAttribute('aria-label', `${quantity.name}, place by phase`);
    }
    this.atTime(this.time);
  }

  arcAt(made, event, from, to) {
    const box = made.getBoundingClientRect();
    const share = ((event.clientX - box.left) / box.width - from) / (to - from);
    return Math.max(0, Math.min(this.count - 1, Math.round(share * (this.count - 1))));
  }

  x(arc) {
    return CHART.left + (this.width - CHART.left - CHART.right) * arc / (this.count - 1);
  }

  y(value) {
    return CHART.height - CHART.bottom - (CHART.height - CHART.top - CHART.bottom) * (value - this.low) / (this.high - this.low);
  }

  /** Broken where it is not known. */
  path(values) {
    return values.map((value, k) => (known(value)
      ? `${k > 0 && known(values[k - 1]) ? 'L' : 'M'}${this.x(k).toFixed(1)} ${this.y(value).toFixed(1)}` : '')).join('');
  }

  draw() {
    this.curves = this.values.map((one) => drawing('path', { d: this.path(one), class: 'phase' }));
    const parts = [];
    const step = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20].find((one) => (this.high - this.low) / one < 6) || 50;
    for (let value = Math.ceil(this.low / step) * step; value <= this.high; value += step) {
      parts.push(drawing('path', { d: `M${CHART.left} ${this.y(value)}H${this.width - CHART.right}`, class: 'grid' }),
        drawing('text', { x: CHART.left - 5, y: this.y(value) + 4, class: 'end' }, [value.toFixed(step < 1 ? 1 : 0)]));
    }
    const every = [5, 10, 20, 50, 100].find((one) => this.count / one < this.width / 60) || 200;
    for (let arc = 0; arc < this.count; arc += every) {
      parts.push(drawing('text', { x: this.x(arc), y: CHART.height - 10, class: 'middle' }, [`${arc}`]));
    }
    this.chart.replaceChildren(...parts, drawing('text', { x: 2, y: 12 }, [this.quantity.unit]), ...this.curves,
      drawing('path', { d: this.path(this.healthy), class: 'healthy' }), drawing('path', { d: this.path(this.median), class: 'median' }), this.line);
  }

  paint(low, high) {
    const context = this.map.getContext('2d');
    const pixels = context.createImageData(this.count, this.order.length);
    this.order.forEach((phase, row) => this.values[phase].forEach((value, k) => {
      const colour = known(value) ? mapColour((value - low) / (high - low || 1)) : [128, 128, 128];
      // The last phase is the uppermost row.
      pixels.data.set([...colour, 255], 4 * ((this.order.length - 1 - row) * this.count + k));
    }));
    context.putImageData(pixels, 0, 0);
  }

  read(arc, phase) {
    const diameter = this.vessel.diameter[phase][arc];
    const degree = this.vessel.degree[phase][arc];
    this.reading.textContent = `${arc} mm, ${(100 * this.cycle.times[phase]).toFixed(0)} %R-R: ${known(diameter)
      ? `${diameter.toFixed(2)} mm${known(degree) && degree > 0 ? `, narrowed by ${(100 * degree).toFixed(0)} %` : ''}` : 'not seen'}`;
  }

  /** The curve of the phase that the model is shown in. @param fraction  of R-R */
  atTime(fraction) {
    this.time = fraction;
    this.curves.forEach((curve, k) => curve.classList.toggle('now', Math.abs(this.cycle.times[k] - fraction) < 2e-3));
  }

  /** @param arc  mm from the vessel's beginning */
  show(arc) {
    const x = this.x(Math.max(0, Math.min(this.count - 1, arc)));
    this.line.setAttribute('d', `M${x} ${CHART.top}V${CHART.height - CHART.bottom}`);
    this.cursor.hidden = false;
    this.cursor.style.left = `${100 * (Math.min(this.count - 1, arc) + 0.5) / this.count}%`;
  }
}
