// The page: what is shown, and what buttons, keys and fingers do to it.

const RED = [214, 39, 40];
const GREEN = [60, 179, 80];
const LINE_COLOURS = { model: [122, 12, 20], truth: [10, 92, 40] };
const DARK_LINE_COLOURS = { model: [255, 176, 170], truth: [170, 240, 180] };
const GUESSED = [232, 128, 0];
const CHOSEN = [26, 95, 180];
const DARK_CHOSEN = [255, 214, 80];
const NEAR_VIEW = 60; // mm that the picture is high when one goes to a place
const PAPER_WIDTH = 680;  // of the printed picture at most, CSS pixels: 18 cm
const PAPER_HEIGHT = 530;
const MODES = ['model', 'truth', 'overlay', 'model-distance', 'truth-distance'];
const PLAY = 'M5 3l12 7-12 7z';
const PAUSE = 'M5 3h4v14H5zM11 3h4v14h-4z';

function byId(id) {
  return document.getElementById(id);
}

class Review {
  constructor(data) {
    this.data = data;
    this.camera = new Camera();
    this.stage = byId('stage');
    this.canvas = byId('canvas');
    this.index = 0;       // of the case
    this.phase = 0;       // of the case's phases
    this.order = [0];     // phases as they follow each other in the beat
    this.mode = 'overlay';
    this.range = 1;       // mm
    this.shapes = null;   // until they are read
    this.shapesOf = new Map();
    this.picked = null;
    this.chosen = null;   // branch of the truth
    this.playing = false;
    this.quality = 0;     // while something moves
    this.movedAt = 0;
    this.drawn = 0;
    this.dark = matchMedia('(prefers-color-scheme: dark)');
  }

  start() {
    this.fillCases();
    this.listen();
    try {
      this.painter = new Painter(this.canvas);
    } catch (error) {
      this.complain(error.message);
    }
    this.run = new RunPanel((place, near) => this.goToPlace(place, near));
    this.fillColourBar();
    new ResizeObserver(() => this.resize()).observe(this.stage);
    this.resize();
    this.showCase(0);
  }

  complain(message) {
    const trouble = byId('trouble');
    trouble.textContent = message;
    trouble.hidden = false;
    byId('wait').hidden = true;
    this.stage.dataset.state = 'trouble';
  }

  get table() {
    return this.data.table1.cases[this.index];
  }

  /** Whether the case has a truth; one of a run alone has not. */
  get compared() {
    return this.data.cases[this.index].shapes.truth !== null;
  }

  // --- cases and phases

  fillCases() {
    const chooser = byId('case');
    this.data.cases.forEach((one, k) => chooser.append(element('option', { value: k }, [one.name])));
    chooser.closest('label').hidden = this.data.cases.length < 2;
  }

  async showCase(index) {
    this.index = index;
    this.phase = 0;
    this.shapes = null;
    this.picked = null;
    this.stage.dataset.state = 'reading';
    this.stage.dataset.case = index;
    byId('case').value = index;
    byId('wait').hidden = !this.painter;
    const phases = this.table.phases;
    this.order = phases.map((_, k) => k);
    if (phases.every((phase) => phase.fraction !== null)) {
      this.order.sort((a, b) => phases[a].fraction - phases[b].fraction || a - b);
    }
    const { run } = this.data.cases[index];
    this.phase = this.compared ? this.worstPhase : run ? run.reference : this.order[0];
    this.setRange(this.data.cases[index].range);
    this.run.fill(this.data.cases[index].run || null);
    this.run.mark(null);
    this.fillPictures();
    byId('modes').hidden = !this.compared;
    byId('against').textContent = this.compared ? 'against the truth' : 'and the image it was found in';
    byId('transport').hidden = phases.length < 2;
    document.querySelectorAll('.of-truth').forEach((one) => { one.hidden = !this.compared; });
    document.querySelectorAll('.of-measures').forEach((one) => { one.hidden = !this.compared; });
    this.chosen = null;
    // Where the answer is: the model by its distance from the truth, when that is furthest.
    this.setMode(this.compared ? 'model-distance' : 'model');
    if (!this.compared) {
      byId('lines').checked = true;
    }
    this.fillTables();
    this.fillGlance();
    this.fillTicks();
    this.showPhase(this.phase);
    if (!this.painter) {
      return;
    }
    this.painter.clear();
    try {
      // One at a time in memory: a case has tens of megabytes.
      const shapes = await readShapes(this.data.cases[index].shapes, byId(`shapes-${index}`).textContent);
      if (this.index !== index) {
        return;
      }
      this.shapes = shapes;
      this.fillAbout();
      this.camera.reset(this.data.cases[index].view);
      byId('wait').hidden = true;
      this.stage.dataset.state = 'ready';
      this.readOut();
      this.update();
    } catch (error) {
      this.complain(error.message);
    }
  }

  /** The phase with the greatest Hausdorff distance. */
  get worstPhase() {
    const far = this.table.phases.map((phase) => (known(phase.HD) ? phase.HD : -1));
    return far.indexOf(Math.max(...far));
  }

  /** "3 (39 %)". */
  phaseName(index) {
    const phase = this.table.phases[index];
    return phase.fraction === null ? `${phase.phase}` : `${phase.phase} (${(100 * phase.fraction).toFixed(0)} %)`;
  }

  /** One sentence, what is lost, and the branches. */
  fillGlance() {
    if (!this.compared) {
      return;
    }
    const { table } = this;
    byId('glance-case').textContent = this.data.cases.length > 1 ? table.name : '';
    const worst = table.phases[this.worstPhase];
    const parts = [`Worst phase ${this.phaseName(this.worstPhase)}: HD ${written(worst.HD, 2)} mm`];
    if (known(worst.HD95)) {
      parts.push(`95 % of the surfaces within ${written(worst.HD95, 2)} mm`);
    }
    if (known(worst.ASSD)) {
      parts.push(`mean ${written(worst.ASSD, 2)} mm`);
    }
    if (known(worst.found)) {
      parts.push(`${(100 * worst.found).toFixed(0)} % of the true tree’s length found`);
    }
    byId('verdict').textContent = `${parts.join(', ')}.`;
    byId('glance-findings').replaceChildren(...table.findings.map((text) => element('li', {}, [text])));
    const { branches } = this.data.cases[this.index];
    const any = fillBranches(byId('branches'), branches, table.phases.map((_, k) => this.phaseName(k)), (branch) => this.choose(branch));
    byId('branches').closest('.scroll').hidden = !any;
  }

  /** Goes to a branch of the truth in its worst phase, near, and to its point that is furthest from the model. */
  choose(branch) {
    this.goTo(branch.worst);
    this.chosen = branch;
    for (const row of byId('branches').querySelectorAll('tbody tr')) {
      row.toggleAttribute('aria-current', row.dataset.branch === `${branch.group}`);
    }
    const here = branch.all.find((one) => one.phase === branch.worst);
    // Of what the model lacks only the truth shows where.
    if (here.covered < LOST_SHARE && !this.sides.includes('truth')) {
      this.setMode('overlay');
    }
    const box = this.shapes && this.boxOf(branch.label);
    if (box) {
      this.camera.centre = box.map(([low, high]) => 0.5 * (low + high));
      this.camera.height = Math.max(30, 1.3 * Math.max(...box.map(([low, high]) => high - low)));
    }
    const side = here.covered < LOST_SHARE || !this.sides.includes('model') ? 'truth' : 'model';
    this.pickFarthest((series, frame, point) => this.shapes[side] === series && series.branch(frame, point) === branch.label);
    byId('stage').scrollIntoView({ block: 'nearest' });
    this.dirty = null;
    this.moved();
  }

  /** Of a branch's line, or else of its surface, in the phase that is shown: least and greatest along the axes; null: it is not there. */
  boxOf(label) {
    for (const series of [this.shapes.truth_lines, this.shapes.truth]) {
      const frame = series && series.frames[this.phase];
      const box = [0, 1, 2].map(() => [Infinity, -Infinity]);
      for (let point = 0; frame && point < frame.topology.points; ++point) {
        if (series.branch(frame, point) === label) {
          series.position(frame, point).forEach((value, axis) => {
            box[axis] = [Math.min(box[axis][0], value), Math.max(box[axis][1], value)];
          });
        }
      }
      if (box[0][0] <= box[0][1]) {
        return box;
      }
    }
    return null;
  }

  fillTables() {
    if (!this.compared) {
      this.plots = [];
      this.fillAbout();
      this.markPhase();
      return;
    }
    const all = byId('all-measures').checked;
    byId('part-a-case').textContent = this.data.cases.length > 1 || this.table.name ? this.table.name : '';
    fillPartA(byId('part-a'), this.data, this.index, all, (k) => this.goTo(k));
    fillPartB(byId('part-b'), this.data, all, (k) => k !== this.index && this.showCase(k));
    byId('part-b').querySelector(`[data-case="${this.index}"]`).setAttribute('aria-current', 'true');
    byId('warnings').replaceChildren(...[...this.table.warnings, ...this.data.warnings].map((text) => element('li', {}, [text])));
    const keys = columnsOf(this.data, this.table.phases, all).map((column) => column.key);
    this.plots = this.data.plots.filter((plot) => keys.includes(plot.key))
      .map((plot) => new Plot(plot, this.index, this.table.phases, (k) => this.goTo(k)));
    byId('plots').replaceChildren(...this.plots.map((plot) => plot.svg));
    this.fillAbout();
    this.markPhase();
  }

  /** Those for papers, as they are in pictures/. */
  fillPictures() {
    const { pictures } = this.data.cases[this.index];
    byId('of-pictures').hidden = pictures.length === 0;
    byId('pictures').replaceChildren(...pictures.map(({ title, file, picture }) => {
      const figure = element('figure', { class: 'later' }, [element('img', { alt: title, 'data-picture': picture }),
        element('figcaption', {}, [title, ' (', element('a', { href: file }, [file]), ')'])]);
      this.run.observer.observe(figure);
      return figure;
    }));
  }

  fillTicks() {
    byId('phase').max = this.order.length - 1;
    const every = Math.ceil(this.order.length / 10);
    byId('ticks').replaceChildren(...this.order.map((index, place) => {
      const phase = this.table.phases[index];
      const text = phase.fraction === null ? `${phase.phase}` : (100 * phase.fraction).toFixed(0);
      const tick = element('li', { class: kindOf(phase), 'data-phase': index,
        title: `Phase ${phase.phase}, ${percentOf(phase)}, ${kindOf(phase)}` },
      [drawing('svg', { viewBox: '-6 -6 12 12' }, [markOf(kindOf(phase), 0, 0, 3.4)]),
        element('span', {}, [place % every === 0 ? text : ''])]);
      tick.addEventListener('click', () => this.goTo(index));
      return tick;
    }));
  }

  /** By hand: the beat stops. */
  goTo(index) {
    this.play(false);
    this.showPhase(index);
  }

  step(by) {
    const count = this.order.length;
    this.goTo(this.order[(this.order.indexOf(this.phase) + by + count) % count]);
  }

  showPhase(index) {
    this.phase = index;
    this.stage.dataset.phase = index;
    this.markPhase();
    this.readOut();
    this.update();
  }

  markPhase() {
    const phase = this.table.phases[this.phase];
    const place = this.order.indexOf(this.phase);
    const slider = byId('phase');
    slider.value = place;
    slider.setAttribute('aria-valuetext', `phase ${phase.phase}, ${percentOf(phase)}, ${kindOf(phase)}`);
    for (const marked of document.querySelectorAll('[data-phase][aria-current]')) {
      marked.removeAttribute('aria-current');
    }
    for (const one of document.querySelectorAll(`#part-a [data-phase="${this.phase}"], #ticks [data-phase="${this.phase}"]`)) {
      one.setAttribute('aria-current', 'true');
    }
    const distances = known(phase.HD) ? [element('span', {}, [`HD ${written(phase.HD, 2)}  MSD ${written(phase.MSD, 2)} mm`])] : [];
    byId('caption').replaceChildren(element('strong', {}, [`Phase ${phase.phase}`]), ` ${percentOf(phase)} `,
      // Of a result at rest nothing was tracked.
      this.compared || this.order.length > 1 ? element('em', { class: kindOf(phase) }, [kindOf(phase)]) : '', ...distances);
    this.plots.forEach((plot) => plot.show(this.phase));
    this.run.atTime(phase.fraction);
  }

  play(on) {
    this.playing = on;
    byId('play-shape').setAttribute('d', on ? PAUSE : PLAY);
    byId('play').setAttribute('aria-label', on ? 'Pause' : 'Play');
    byId('caption').setAttribute('aria-live', on ? 'off' : 'polite');
    this.stage.dataset.playing = on ? 'yes' : 'no';
    if (on) {
      this.changedAt = performance.now();
      this.update();
    }
  }

  /** How long a phase is shown: to the next one's fraction; a beat takes as long as was chosen. */
  get duration() {
    const beat = 1000 * Number(byId('speed').value);
    const count = this.order.length;
    const place = this.order.indexOf(this.phase);
    const fraction = (k) => this.table.phases[this.order[k]].fraction;
    if (count < 2 || this.table.phases.some((phase) => phase.fraction === null)) {
      return beat / count;
    }
    const gap = place + 1 < count ? fraction(place + 1) - fraction(place) : fraction(place) - fraction(place - 1);
    return Math.max(20, Math.min(beat, beat * gap));
  }

  // --- drawing

  /** Soon, once. */
  update() {
    if (!this.waiting) {
      this.waiting = true;
      requestAnimationFrame((time) => this.frame(time));
    }
  }

  /** Something moves: quickly first, finely when it has come to rest. */
  moved() {
    this.movedAt = performance.now();
    this.update();
  }

  frame(time) {
    this.waiting = false;
    if (!this.shapes) {
      return;
    }
    if (this.playing && time - this.changedAt >= this.duration) {
      // Phases that a slow machine has no time for are not left out.
      this.changedAt = Math.max(this.changedAt + this.duration, time - this.duration);
      const count = this.order.length;
      this.showPhase(this.order[(this.order.indexOf(this.phase) + 1) % count]);
      this.waiting = false;
    }
    const moving = this.playing || time - this.movedAt < 200;
    if (moving && this.lastMoving) {
      this.adapt(time - this.lastFrame);
    }
    this.lastMoving = moving;
    this.lastFrame = time;
    if (!this.playing || this.dirty !== this.stateKey(moving)) {
      this.draw(moving);
      this.dirty = this.stateKey(moving);
    }
    if (moving) {
      this.update();
    }
  }

  /** What a drawing depends on, while the beat plays. */
  stateKey(moving) {
    const { leftAnterior, cranial, centre, height } = this.camera;
    return JSON.stringify([this.phase, this.mode, this.range, this.quality, moving, leftAnterior, cranial, centre, height]);
  }

  /** Coarser when pictures take long. */
  adapt(duration) {
    this.pace = 0.7 * (this.pace || 20) + 0.3 * Math.min(duration, 500);
    if (this.pace > 55 && this.quality < QUALITIES.length - 1) {
      this.quality += 1;
      this.pace = 25;
    }
  }

  get shown() {
    const { model, truth } = this.shapes;
    const surface = (series, colour, opacity, range) =>
      ({ series, frame: series.frames[this.phase], colour, opacity, range });
    const opacity = (id) => Number(byId(id).value);
    if (!model) {
      return []; // a run without a surface: lines only
    }
    switch (this.mode) {
      case 'model': return [surface(model, RED, 1, 0)];
      case 'truth': return [surface(truth, GREEN, 1, 0)];
      case 'model-distance': return [surface(model, RED, 1, this.range)];
      case 'truth-distance': return [surface(truth, GREEN, 1, this.range)];
      default: return [surface(model, RED, opacity('model-opacity'), 0), surface(truth, GREEN, opacity('truth-opacity'), 0)];
    }
  }

  /** Sides that are shown: "model", "truth". */
  get sides() {
    return ['model', 'truth'].filter((side) => this.mode === 'overlay' || this.mode.startsWith(side));
  }

  get trees() {
    return this.sides.map((side) => ({ side, series: this.shapes[`${side}_lines`] }))
      .filter(({ series }) => series && series.frames[this.phase].topology.points > 0);
  }

  /** The axis of the branch that was chosen, of the truth, in this phase. */
  get chosenLine() {
    const series = this.chosen && this.shapes.truth_lines;
    const frame = series && series.frames[this.phase];
    if (!frame) {
      return null;
    }
    const { label } = this.chosen;
    frame.parts = frame.parts || new Map();
    if (!frame.parts.has(label)) {
      const cells = frame.topology.cells.filter((_, k, all) =>
        series.branch(frame, all[k & ~1]) === label && series.branch(frame, all[k | 1]) === label);
      frame.parts.set(label, { positions: frame.positions, topology: { cells } });
    }
    return { series, frame: frame.parts.get(label) };
  }

  get background() {
    return getComputedStyle(this.stage).backgroundColor.match(/[\d.]+/g).slice(0, 3).map((part) => part / 255);
  }

  /** @param moving coarser while it moves @param paper in the colours of a light page */
  draw(moving = false, paper = false) {
    if (!this.shapes || !this.painter || this.painter.gl.isContextLost()) {
      return;
    }
    const colours = this.dark.matches && !paper ? DARK_LINE_COLOURS : LINE_COLOURS;
    const lines = byId('lines').checked
      ? this.trees.map(({ side, series }) => ({ series, frame: series.frames[this.phase], colour: colours[side] }))
      : [];
    const guessed = this.shapes.guessed_lines;
    if (guessed) {
      lines.push({ series: guessed, frame: guessed.frames[this.phase], colour: GUESSED, width: 4 });
    }
    const chosen = this.chosenLine;
    if (chosen) {
      lines.push({ ...chosen, colour: this.dark.matches && !paper ? DARK_CHOSEN : CHOSEN, width: 4 });
    }
    this.painter.draw(this.camera, this.shown, lines, paper ? [1, 1, 1] : this.background, moving ? this.quality : 0);
    this.placeNames();
    this.placeMark();
    this.showView();
    this.drawn += 1;
    this.stage.dataset.drawn = this.drawn;
  }

  showView() {
    const camera = this.camera;
    byId('view-name').textContent = camera.name;
    this.stage.dataset.view = camera.name;
    byId('compass').replaceChildren(...this.compass());
    const length = [100, 50, 20, 10, 5, 2, 1, 0.5, 0.2].find((one) => one / camera.millimetresPerPixel < 0.22 * camera.width) || 0.1;
    const scale = byId('scale');
    scale.style.width = `${length / camera.millimetresPerPixel}px`;
    scale.firstElementChild.textContent = `${length} mm`;
  }

  /** The patient's axes: right, left, anterior, posterior, head, feet. */
  compass() {
    const { right, up, towards } = this.camera.axes;
    const ends = [['L', 1, 0, 0], ['R', -1, 0, 0], ['P', 0, 1, 0], ['A', 0, -1, 0], ['H', 0, 0, 1], ['F', 0, 0, -1]];
    return ends.map(([letter, ...end]) => ({ letter, x: 34 * dot(end, right), y: -34 * dot(end, up), depth: dot(end, towards) }))
      .sort((a, b) => a.depth - b.depth)
      .flatMap(({ letter, x, y, depth }) => {
        const opacity = (0.35 + 0.65 * (0.5 + 0.5 * depth)).toFixed(2);
        const kind = letter === 'L' || letter === 'R' ? 'x' : letter === 'A' || letter === 'P' ? 'y' : 'z';
        return [drawing('line', { x1: 0, y1: 0, x2: (0.72 * x).toFixed(1), y2: (0.72 * y).toFixed(1), class: kind, opacity }),
          drawing('text', { x: x.toFixed(1), y: (y + 4.5).toFixed(1), class: kind, opacity }, [letter])];
      });
  }

  placeNames() {
    const place = byId('names');
    const named = byId('labels').checked ? this.trees[0] : null;
    if (!named) {
      place.replaceChildren();
      return;
    }
    const { series, side } = named;
    const frame = series.frames[this.phase];
    // Nearer ones first; what would cover another name is left out.
    const boxes = [];
    const texts = frame.topology.labels
      .map((label) => ({ text: label.text, ...this.camera.project(series.position(frame, label.point)) }))
      .sort((a, b) => b.depth - a.depth)
      .filter(({ text, x, y }) => {
        const box = { left: x, right: x + 7.5 * text.length + 14, top: y - 10, bottom: y + 10 };
        const free = boxes.every((one) => box.right < one.left || box.left > one.right || box.bottom < one.top || box.top > one.bottom);
        if (free) {
          boxes.push(box);
        }
        return free;
      })
      .map(({ text, x, y }) => {
        const made = element('span', { class: side }, [text]);
        made.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
        return made;
      });
    place.replaceChildren(...texts);
  }

  // --- the point that is read

  pick(x, y) {
    if (!this.shapes) {
      return;
    }
    const opaque = this.shown.filter(({ opacity }) => opacity > 0.02);
    if (!this.shapes.model) {
      this.pickLine(x, y);
      return;
    }
    let best = null;
    for (const { series, frame } of opaque) {
      const hit = this.camera.pick(series, frame, x, y);
      if (hit && (!best || hit.depth > best.hit.depth)) {
        best = { hit, series, frame };
      }
    }
    this.picked = best && { series: best.series, topology: best.frame.topology,
      corners: best.hit.corners, weights: best.hit.weights, point: best.hit.point };
    this.readOut();
    this.update();
  }

  /** Without a surface: the point of the tree that is nearest on the picture. */
  pickLine(x, y) {
    const series = this.shapes.model_lines;
    const frame = series.frames[this.phase];
    let best = null;
    for (let point = 0; point < frame.topology.points; ++point) {
      const at = this.camera.project(series.position(frame, point));
      const distance = Math.hypot(at.x - x, at.y - y);
      if (distance < (best ? best.distance : 15)) {
        best = { distance, point };
      }
    }
    this.picked = best && { series, topology: frame.topology, corners: [best.point, best.point, best.point],
      weights: [1, 0, 0], point: best.point };
    this.readOut();
    this.update();
  }

  /** A place of the reference phase, from a table or a picture. */
  goToPlace(place, near) {
    this.goTo(this.data.cases[this.index].run.reference);
    this.picked = { place };
    if (near) {
      this.camera.centre = place.slice();
      this.camera.height = Math.min(this.camera.height, NEAR_VIEW);
      const figure = this.run.nearest(place) && this.run.figures.find(({ vessel }) => vessel === this.run.nearest(place).vessel);
      if (figure) {
        figure.article.scrollIntoView({ block: 'nearest' });
      }
    }
    this.readOut();
    this.moved();
  }

  /** To the point of what is shown that is furthest from the other surface. @param wanted  of (series, frame, point); by default all */
  pickFarthest(wanted = () => true) {
    if (!this.shapes) {
      return;
    }
    let farthest = null;
    for (const side of this.sides) {
      const series = this.shapes[side];
      const frame = series.frames[this.phase];
      for (let point = 0; point < frame.topology.points; ++point) {
        const distance = Math.abs(series.distance(frame, point));
        if (distance > (farthest ? farthest.distance : -1) && wanted(series, frame, point)) {
          farthest = { distance, series, frame, point };
        }
      }
    }
    if (farthest) {
      const { series, frame, point } = farthest;
      this.picked = { series, topology: frame.topology, corners: [point, point, point], weights: [1, 0, 0], point };
      this.readOut();
      this.update();
    }
  }

  /** Follows the point through the phases, as long as these share their points. */
  get pickedNow() {
    const picked = this.picked;
    if (picked && picked.place) {
      const here = this.phase === this.data.cases[this.index].run.reference;
      return here ? { side: 'model', position: picked.place, distance: NaN, branch: '' } : null;
    }
    const frame = picked && this.shapes && picked.series.frames[this.phase];
    const visible = picked && this.shapes && this.sides.some((side) =>
      this.shapes[side] === picked.series || this.shapes[`${side}_lines`] === picked.series);
    if (!visible || frame.topology !== picked.topology) {
      return null;
    }
    const mix = (value) => picked.corners.reduce((sum, corner, k) => sum + picked.weights[k] * value(corner), 0);
    return {
      side: picked.series === this.shapes.truth ? 'truth' : 'model',
      position: [0, 1, 2].map((axis) => mix((corner) => picked.series.position(frame, corner)[axis])),
      distance: mix((corner) => picked.series.distance(frame, corner)),
      branch: picked.series.branch(frame, picked.point),
    };
  }

  readOut() {
    const now = this.pickedNow;
    const readout = byId('readout');
    readout.classList.toggle('read', Boolean(now));
    // Pictures are of the reference phase.
    const run = this.data.cases[this.index].run;
    this.run.mark(now && run && this.phase === run.reference ? now.position : null);
    if (!now) {
      readout.textContent = this.compared ? 'Click the surface to read the distance, the branch and the phase there.'
        : 'Click the model, a picture or a row of a table to see the same place in the others.';
      return;
    }
    const phase = this.table.phases[this.phase];
    const place = `L ${now.position[0].toFixed(1)}, P ${now.position[1].toFixed(1)}, H ${now.position[2].toFixed(1)} mm`;
    if (!this.compared || this.picked.place) {
      const near = this.phase === run.reference ? this.run.nearest(now.position) : null;
      readout.replaceChildren(element('strong', {}, [near ? near.vessel.name : now.branch || 'no vessel within 4 mm']),
        element('span', {}, [near ? `${near.arc} mm along it` : '']), element('span', {}, [place]));
      return;
    }
    const other = now.side === 'model' ? 'truth' : 'model';
    const distance = Number.isFinite(now.distance)
      ? `${Math.abs(now.distance).toFixed(2)} mm ${now.distance < 0 ? 'inside' : 'outside'} the ${other}` : 'distance not known';
    readout.replaceChildren(element('strong', {}, [distance]),
      element('span', {}, [now.branch || 'branch not known']),
      element('span', {}, [`on the ${now.side}, phase ${phase.phase}, ${percentOf(phase)}, ${kindOf(phase)}`]),
      element('span', {}, [place]), ...this.reasons(now).map((text) => element('span', { class: 'reason' }, [text])));
  }

  /** What is known of why a point is far from the other surface. */
  reasons(now) {
    const phase = this.table.phases[this.phase];
    const branches = this.data.cases[this.index].branches[this.phase] || [];
    // Several pieces of a vessel have one name: the worst of them.
    const own = branches.filter((one) => one.label && one.label === now.branch).sort((a, b) => a.covered - b.covered)[0];
    const reasons = [];
    if (now.side === 'truth' && own && own.covered < LOST_SHARE) {
      reasons.push(`The model lacks it: ${(100 * own.covered).toFixed(0)} % of ${own.label} (${own.length.toFixed(0)} mm) is found in this phase.`);
    }
    if (now.side === 'model' && (phase.false_branches || []).some((one) => (one.label || one.vessel) === now.branch)) {
      reasons.push('A line of the model that is no vessel.');
    }
    if (known(phase.HD) && Math.abs(Math.abs(now.distance) - phase.HD) < 0.05) {
      reasons.push(`It is the phase’s HD${known(phase.HD95) ? `; 95 % of the surfaces are within ${phase.HD95.toFixed(2)} mm` : ''}.`);
    }
    return reasons;
  }

  placeMark() {
    const now = this.pickedNow;
    const mark = byId('mark');
    mark.hidden = !now;
    if (now) {
      const { x, y } = this.camera.project(now.position);
      mark.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
    }
  }

  // --- what is shown

  setMode(mode) {
    if (mode !== 'model' && !this.compared) {
      return;
    }
    this.mode = mode;
    this.stage.dataset.mode = mode;
    document.querySelector(`input[name="mode"][value="${mode}"]`).checked = true;
    byId('colours').hidden = !mode.endsWith('distance');
    document.querySelectorAll('.of-distance').forEach((one) => { one.hidden = !mode.endsWith('distance'); });
    document.querySelectorAll('.of-overlay').forEach((one) => { one.hidden = mode !== 'overlay'; });
    byId('key').replaceChildren(...(mode.endsWith('distance') ? [] : this.sides).map((side) => element('span', { class: side }, [side])),
      ...(this.data.cases[this.index].shapes.guessed_lines ? [element('span', { class: 'guessed' }, ['guessed'])] : []));
    this.readOut();
    this.update();
  }

  fillColourBar() {
    const bar = document.querySelector('#colours .bar i');
    bar.style.background = `linear-gradient(to top, ${COLOURS.map((one) => `rgb(${one.slice(1).join(' ')})`).join(', ')})`;
    this.setMode(this.mode);
  }

  setRange(range) {
    if (!(range > 0)) {
      return;
    }
    this.range = range;
    byId('range').value = Number(range.toPrecision(6));
    const number = (value) => Number(value.toPrecision(3)).toString().replace('-', '−');
    byId('colours').querySelector('ol').replaceChildren(...[1, 0.5, 0, -0.5, -1].map((part) =>
      element('li', {}, [part === 1 ? `≥ ${number(range)}` : part === -1 ? `≤ ${number(-range)}` : number(part * range)])));
    this.update();
  }

  fillAbout() {
    const one = this.data.cases[this.index];
    const rows = [['Made by', this.data.version], ['Command', this.data.command], ...this.data.settings];
    if (this.data.inputs.length > 0) {
      const { model, truth } = this.data.inputs[this.index];
      rows.push(['Read from', `${model} (model), ${truth} (truth)`]);
    }
    if (this.data.files.length > 0) {
      // Of several cases each has its pictures in a folder of its own.
      const own = this.data.cases.length > 1 ? `pictures/${this.index + 1}/` : '';
      const files = this.data.files.filter((file) => file.startsWith(own) || !file.startsWith('pictures/'));
      const links = files.flatMap((file) => [', ', element('a', { href: file }, [file])]);
      rows.push(['Files beside it', element('span', {}, links.slice(1))]);
    }
    if (this.compared) {
      rows.push(['Distances', 'of the surfaces as they were, to the nearest point of the other one’s triangles; negative: inside. The colours ' +
        `end at ±${one.range} mm as in the pictures: 99.5 % of the points are nearer there`]);
    }
    for (const [side, title] of [['model', 'Model'], ['truth', 'Truth']]) {
      const layout = one.shapes[side];
      if (!layout) {
        continue;
      }
      const shown = Math.max(...layout.topologies.map((topology) => topology.indices / layout.corners));
      const exact = `positions to ${(0.5 * Math.hypot(...layout.step)).toFixed(4)} mm${this.compared ? `, distances to ${(0.5 * layout.distance_step).toFixed(4)} mm` : ''}`;
      rows.push([title, shown < layout.original_cells
        ? `shown reduced: ${shown.toLocaleString('en')} of ${layout.original_cells.toLocaleString('en')} triangles, at most ` +
          `${layout.deviation.toFixed(3)} mm off (Hausdorff distance, all phases); ${exact}`
        : `all ${shown.toLocaleString('en')} triangles; ${exact}`]);
    }
    if (this.compared) {
      rows.push(['Table 1', 'of the surfaces as they were, with all their triangles']);
    }
    if (one.run) {
      rows.push(['Pictures', 'of the reference phase, in which the tree was found; places are LPS in mm']);
    }
    byId('about').replaceChildren(...rows.flatMap(([name, text]) => [element('dt', {}, [name]), element('dd', {}, [text])]));
  }

  // --- input

  resize() {
    const box = this.stage.getBoundingClientRect();
    if (!box.width || !box.height) {
      return;
    }
    const ratio = Math.min(2, devicePixelRatio || 1);
    this.canvas.width = Math.round(box.width * ratio);
    this.canvas.height = Math.round(box.height * ratio);
    this.camera.resize(box.width, box.height, this.data.cases[this.index].view.aspect);
    // At once: a canvas of another size is empty.
    this.draw(false);
  }

  /** No branch of the truth is chosen any more. */
  unchoose() {
    this.chosen = null;
    byId('branches').querySelectorAll('[aria-current]').forEach((one) => one.removeAttribute('aria-current'));
  }

  reset() {
    this.unchoose();
    this.camera.reset(this.data.cases[this.index].view);
    this.moved();
  }

  listen() {
    const on = (id, kind, act) => byId(id).addEventListener(kind, act);
    on('case', 'change', (event) => this.showCase(Number(event.target.value)));
    on('phase', 'input', (event) => { this.goTo(this.order[Number(event.target.value)]); });
    on('play', 'click', () => this.play(!this.playing));
    on('back', 'click', () => this.step(-1));
    on('forth', 'click', () => this.step(1));
    for (const id of ['lines', 'labels']) {
      on(id, 'change', () => { this.dirty = null; this.update(); });
    }
    for (const id of ['model-opacity', 'truth-opacity']) {
      on(id, 'input', () => { this.dirty = null; this.update(); });
    }
    on('range', 'change', (event) => this.setRange(Number(event.target.value)));
    on('range-reset', 'click', () => this.setRange(this.data.cases[this.index].range));
    on('farthest', 'click', () => {
      this.unchoose();
      this.pickFarthest();
    });
    on('all-measures', 'change', () => this.fillTables());
    document.querySelectorAll('input[name="mode"]').forEach((one) =>
      one.addEventListener('change', () => this.setMode(one.value)));
    document.querySelectorAll('.views button').forEach((button) => button.addEventListener('click', () => {
      if (button.dataset.view === 'reset') {
        this.reset();
        return;
      }
      [this.camera.leftAnterior, this.camera.cranial] = button.dataset.view.split(' ').map(Number);
      this.moved();
    }));
    document.addEventListener('keydown', (event) => this.key(event));
    this.dark.addEventListener('change', () => { this.dirty = null; this.update(); });
    this.listenToPointers();
    this.canvas.addEventListener('webglcontextlost', (event) => event.preventDefault());
    this.canvas.addEventListener('webglcontextrestored', () => {
      this.painter = new Painter(this.canvas);
      this.update();
    });
    addEventListener('beforeprint', () => {
      // The stage keeps its shape on paper: names, the mark and the scale stay where they are on the picture.
      const { offsetWidth: width, offsetHeight: height, style } = this.stage;
      style.setProperty('--width', `${width}px`);
      style.setProperty('--height', `${height}px`);
      style.setProperty('--shrink', Math.min(1, PAPER_WIDTH / width, PAPER_HEIGHT / height));
      this.draw(false, true);
      byId('print').src = this.canvas.toDataURL('image/png');
    });
    addEventListener('afterprint', () => this.draw());
  }

  key(event) {
    const typing = event.target.closest('input:not([type=checkbox]):not([type=radio]), select, textarea');
    if (event.ctrlKey || event.metaKey || event.altKey || typing) {
      return;
    }
    const radio = event.target.matches('input[type=radio]');
    const turn = event.shiftKey ? 10 : 0;
    const act = {
      ArrowLeft: () => (turn ? this.turn(turn, 0) : this.step(-1)),
      ArrowRight: () => (turn ? this.turn(-turn, 0) : this.step(1)),
      ArrowUp: () => this.turn(0, -10),
      ArrowDown: () => this.turn(0, 10),
      ' ': () => this.play(!this.playing),
      '+': () => this.zoom(1.2),
      '=': () => this.zoom(1.2),
      '-': () => this.zoom(1 / 1.2),
      r: () => this.reset(),
      c: () => byId('lines').click(),
      n: () => byId('labels').click(),
    }[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    const own = event.target.matches('button, input[type=checkbox]') && event.key === ' ';
    const scrolls = event.key.startsWith('Arrow') && (radio || (/Up|Down/.test(event.key) && event.target !== this.canvas));
    if (act && !own && !scrolls) {
      event.preventDefault();
      act();
    } else if (/^[1-5]$/.test(event.key)) {
      this.setMode(MODES[Number(event.key) - 1]);
    }
  }

  turn(leftAnterior, cranial) {
    this.camera.turn(leftAnterior, cranial);
    this.moved();
  }

  zoom(factor, x, y) {
    this.camera.zoom(factor, x, y);
    this.moved();
  }

  /** One finger or the left button turns; two fingers, other buttons or shift move; wheel and pinch zoom; a click reads. */
  listenToPointers() {
    const canvas = this.canvas;
    const pointers = new Map();
    let travelled = 0;
    const place = (event) => {
      const box = canvas.getBoundingClientRect();
      return { x: event.clientX - box.left, y: event.clientY - box.top };
    };
    const middle = () => {
      const all = [...pointers.values()];
      const x = all.reduce((sum, one) => sum + one.x, 0) / all.length;
      const y = all.reduce((sum, one) => sum + one.y, 0) / all.length;
      return { x, y, spread: all.length > 1 ? Math.hypot(all[0].x - all[1].x, all[0].y - all[1].y) : 0 };
    };
    canvas.addEventListener('pointerdown', (event) => {
      travelled = pointers.size === 0 ? 0 : Infinity;
      pointers.set(event.pointerId, place(event));
      canvas.setPointerCapture(event.pointerId);
      canvas.focus({ preventScroll: true });
    });
    canvas.addEventListener('pointermove', (event) => {
      if (!pointers.has(event.pointerId)) {
        return;
      }
      const before = middle();
      pointers.set(event.pointerId, place(event));
      const after = middle();
      const [right, down] = [after.x - before.x, after.y - before.y];
      travelled += Math.hypot(right, down);
      if (travelled < 4) {
        return;
      }
      if (pointers.size > 1) {
        this.camera.move(right, down);
        this.camera.zoom(before.spread > 0 ? after.spread / before.spread : 1, after.x, after.y);
      } else if (event.shiftKey || event.buttons & 6) {
        this.camera.move(right, down);
      } else {
        this.camera.turn(-0.4 * right, 0.4 * down);
      }
      this.moved();
    });
    const end = (event) => {
      if (pointers.delete(event.pointerId) && event.type === 'pointerup' && travelled < 4 && event.button === 0) {
        const { x, y } = place(event);
        this.pick(x, y);
      }
    };
    canvas.addEventListener('pointerup', end);
    canvas.addEventListener('pointercancel', end);
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
    canvas.addEventListener('wheel', (event) => {
      event.preventDefault();
      const { x, y } = place(event);
      this.zoom(Math.exp(-0.0015 * event.deltaY * (event.deltaMode ? 30 : 1)), x, y);
    }, { passive: false });
  }
}

new Review(JSON.parse(byId('data').textContent)).start();
