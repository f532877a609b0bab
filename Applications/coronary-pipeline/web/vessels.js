// What a run says of itself: warnings, what was guessed, findings, and its vessels in the image.

// What is found where in what the run says, its title, and what is said of an empty list.
const FINDINGS = [
  ['edits', ['edits'], 'Corrected by hand', 'Nothing was.'],
  ['checks', ['checks'], 'Checks of the whole tree', 'Nothing was noticed.'],
  ['bridges', ['bridges'], 'Guessed across gaps', 'No gap was bridged.'],
  ['lesions', ['lesions'], 'Narrowings', 'No narrowing was found.'],
  ['cycle', ['cycle', 'lesions'], 'Narrowings over the heart cycle', 'No narrowing was found in the median over the phases.'],
  ['calcium', ['calcium', 'objects'], 'Calcium', 'No calcium was found.'],
  ['hidden', ['calcium', 'radius_interpolated'], 'Radius guessed, behind calcium', 'None was.'],
  ['placement', ['placement'], 'How likely each branch is within 1 mm of an artery, at its worst phase', 'Nothing was followed.'],
  ['filled', ['filled'], 'Not seen at a phase, and filled', 'All that was tracked was seen.'],
  ['limits', ['limits', 'clamped'], 'Held back by limits of motion', 'Nothing was held back.'],
];
// Columns that come first; the others follow as they are.
const FIRST_COLUMNS = ['what', 'vessel', 'time', 'status', 'limit', 'kind', 'degree', 'diameter_stenosis_percent', 'range_percent', 'worst_percent',
  'worst_phase_percent', 'mildest_percent', 'pulsation_percent', 'confidence', 'length_mm',
  'least_diameter_mm', 'reference_diameter_mm'];
const PLACES = ['position', 'place', 'at', 'minimum', 'centre', 'center', 'from', 'begin'];
const NEAR_VESSEL = 4; // mm from its axis: a click there belongs to it

function isPlace(value) {
  return Array.isArray(value) && value.length === 3 && value.every(known);
}

function away(a, b) {
  return Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

/** Where a finding is: its place, or half way between its ends; null: it does not say. */
function placeOf(finding) {
  if (isPlace(finding.from) && isPlace(finding.to)) {
    return finding.from.map((value, k) => 0.5 * (value + finding.to[k]));
  }
  const name = PLACES.find((one) => isPlace(finding[one]));
  return name ? finding[name] : null;
}

const UNITS = { mm: 'mm', mm2: 'mm²', mm3: 'mm³', hu: 'HU', percent: '%', deg: '°' };

/** "length_mm" becomes "length" and "mm". */
function wordsOf(key) {
  const [, name, unit] = key.match(/^(.*?)(?:_(mm|mm2|mm3|hu|percent|deg))?$/);
  return { name: name.replace(/_/g, ' '), unit: unit ? UNITS[unit] : '' };
}

/** A range of two numbers. */
function isRange(value) {
  return Array.isArray(value) && value.length === 2 && value.every(known);
}

function shownValue(key, value) {
  if (known(value)) {
    const digits = /_percent$|_hu$|_deg$/.test(key) ? 0 : /_mm$/.test(key) ? 1 : 2;
    return key === 'degree' ? `${(100 * value).toFixed(0)} %` : Number.isInteger(value) ? `${value}` : value.toFixed(digits);
  }
  if (isRange(value)) {
    return `${shownValue(key, value[0])} to ${shownValue(key, value[1])}`;
  }
  return typeof value === 'string' ? value : typeof value === 'boolean' ? (value ? 'yes' : 'no') : '–';
}

/** A row a finding with all that it says in words and numbers. */
function fillFindings(table, findings, onPlace) {
  const plain = (value) => value !== null && (typeof value !== 'object' || isRange(value));
  const order = (key) => (FIRST_COLUMNS.includes(key) ? FIRST_COLUMNS.indexOf(key) : FIRST_COLUMNS.length);
  const keys = [...new Set(findings.flatMap((one) => Object.keys(one).filter((key) => plain(one[key]))))]
    .sort((a, b) => order(a) - order(b));
  const texts = new Set(keys.filter((key) => findings.every((one) => typeof one[key] === 'string' || typeof one[key] === 'boolean')));
  const head = element('thead', {}, [element('tr', {}, [
    element('th', { scope: 'col', class: 'text' }, ['place']), ...keys.map((key) => {
      const { name, unit } = wordsOf(key);
      return element('th', { scope: 'col', class: texts.has(key) ? 'text' : null }, unit ? [name, element('small', {}, [` ${unit}`])] : [name]);
    })])]);
  const body = element('tbody');
  findings.forEach((one) => {
    const place = placeOf(one);
    const cells = keys.map((key) => cell(shownValue(key, one[key]), !texts.has(key) ? null : `${one[key]}`.length > 40 ? 'text long' : 'text'));
    const button = place ? element('button', { type: 'button' }, ['show']) : '–';
    const row = element('tr', { class: place ? 'goes' : null }, [element('td', { class: 'text' }, [button]), ...cells]);
    if (place) {
      row.addEventListener('click', () => onPlace(place));
    }
    body.append(row);
  });
  table.replaceChildren(head, body);
}

class RunPanel {
  /** @param onPlace  called with a place in the reference phase, LPS in mm, and whether to look there from near */
  constructor(onPlace) {
    this.onPlace = onPlace;
    this.run = null;
    this.figures = [];
    this.sheets = [];
    this.observer = new IntersectionObserver((entries) => entries
      .filter((entry) => entry.isIntersecting).forEach((entry) => this.load(entry.target)), { rootMargin: '800px' });
    byId('marks').addEventListener('change', (event) =>
      document.body.classList.toggle('bare', !event.target.checked));
    addEventListener('beforeprint', () => document.querySelectorAll('.view, .later').forEach((one) => this.load(one)));
  }

  /** @param run  null: the case is not of a run */
  fill(run) {
    this.run = run;
    const statement = run && typeof run.statement === 'string' ? run.statement : '';
    byId('motion-statement').textContent = statement && `${statement[0].toUpperCase()}${statement.slice(1)}.`;
    byId('motion-statement').hidden = !statement;
    this.observer.disconnect();
    this.figures = [];
    this.sheets = [];
    document.querySelectorAll('.of-run').forEach((one) => { one.hidden = !run; });
    document.body.classList.toggle('pictured', Boolean(run && run.vessels.some((one) => one.straightened)));
    if (!run) {
      return;
    }
    const warnings = run.warnings.map((text) => element('li', {}, [text]));
    byId('run-warnings').replaceChildren(...warnings);
    byId('run-quiet').hidden = warnings.length > 0;
    byId('run-stages').textContent = run.stages.map((one) =>
      `${one.name} ${one.state === 'finished' && known(one.seconds) ? `${one.seconds.toFixed(1)} s` : one.state}`).join(', ');
    this.fillVessels();
    byId('findings').replaceChildren(...FINDINGS.map((one) => this.findings(...one)));
    const pictured = run.vessels.some((one) => one.straightened);
    const along = pictured || Boolean(run.cycle);
    byId('vessel-views').hidden = !along;
    byId('vessel-views').querySelectorAll('.all, .views-legend').forEach((one) => { one.hidden = !pictured; });
    byId('heart-sheets').hidden = run.sheets.length === 0;
    byId('views').replaceChildren(...(along ? run.vessels.map((one, k) => this.vessel(one, k)) : []));
    byId('sheets').replaceChildren(...run.sheets.map((one) => this.sheet(one)));
    byId('views-note').textContent = 'The diameter over the heart cycle: the radii of the moved lines, without the image.';
    if (pictured) {
      byId('views-note').textContent = `Two cuts at right angles, ±${run.half_width} mm about the axis, then diameter (mm) and the ` +
        `image’s values on the axis; the cross-section at the slider; a curved reformat; a slab of ${run.thickness} mm that follows the vessel; its diameter ` +
        `over the heart cycle. The outer boundary is drawn where fat shows it. Black ${run.window[0].toFixed(0)}, ` +
        `white ${run.window[1].toFixed(0)} (HU). A click shows the place in the model.`;
    }
  }

  findings(kind, path, title, none) {
    let found = path.reduce((inner, name) => (inner && !Array.isArray(inner) ? inner[name] : inner), this.run);
    found = Array.isArray(found) ? found.filter((one) => one !== null && typeof one === 'object') : null;
    const around = path.length > 1 && kind === path[0] ? this.run[kind] : null;
    const parts = [element('h3', {}, [title])];
    if (kind === 'cycle') {
      parts.push(element('p', { class: 'none' }, [!this.run.cycle ? 'There is no motion, or it was not measured.' : this.run.cycle.measured
        ? 'The lumen was measured in the image of each phase; the degree is that of the median over the phases.'
        : 'Of the radii of the moved lines: no image was measured.']));
    } else if (around && !Array.isArray(around)) {
      // What is said of all of them together.
      const all = Object.keys(around).filter((key) => ['number', 'string', 'boolean'].includes(typeof around[key]) && key !== 'file');
      parts.push(element('p', { class: 'none' }, [all.map((key) => {
        const { name, unit } = wordsOf(key);
        return `${name} ${shownValue(key, around[key])}${unit ? ` ${unit}` : ''}`;
      }).join('; ')]));
    }
    if (found && found.length > 0) {
      const table = element('table', { id: `run-${kind}` });
      fillFindings(table, found, (place) => this.onPlace(place, true));
      parts.push(element('div', { class: 'scroll' }, [table]));
    } else {
      parts.push(element('p', { class: 'none' }, [found ? none : 'The run says nothing of it.']));
    }
    return element('div', {}, parts);
  }

  fillVessels() {
    const head = element('thead', {}, [element('tr', {}, [element('th', { scope: 'col', class: 'text' }, ['Vessel']),
      ...[['length', 'mm'], ['bridged', 'mm'], ['radius guessed', 'mm'], ['narrowing', '']].map(([name, unit]) =>
        element('th', { scope: 'col' }, [name, element('small', {}, [` ${unit}`])]))])]);
    const length = (value) => (value > 0 ? value.toFixed(1) : '–');
    const body = element('tbody');
    this.run.vessels.forEach((one, k) => {
      const row = element('tr', { class: one.bridged > 0 ? 'goes guessed' : 'goes', 'data-vessel': k }, [
        element('th', { scope: 'row', class: 'text' }, [element('button', { type: 'button' }, [one.name])]),
        cell(one.length.toFixed(1)), cell(length(one.bridged), one.bridged > 0 ? 'bridged' : null), cell(length(one.interpolated)),
        cell(one.stenosis > 0 ? `${(100 * one.stenosis).toFixed(0)} %` : '–')]);
      row.addEventListener('click', () => this.showVessel(k));
      body.append(row);
    });
    const sum = (key) => this.run.vessels.reduce((total, one) => total + one[key], 0);
    byId('vessels').replaceChildren(head, body, element('tfoot', {}, [element('tr', {}, [
      element('th', { scope: 'row', class: 'text' }, ['all']), cell(sum('length').toFixed(1)), cell(length(sum('bridged'))),
      cell(length(sum('interpolated'))), cell('')])]));
  }

  showVessel(index) {
    const vessel = this.run.vessels[index];
    const figure = this.figures.find((one) => one.vessel === vessel);
    if (figure) {
      figure.article.scrollIntoView({ block: 'nearest' });
    }
    this.onPlace(vessel.path[vessel.path.length >> 1], false);
  }

  /** A picture with its layer of marks and a cursor; loaded when it comes near the window. */
  view(picture, text) {
    const cursor = element('i', { class: 'cursor', hidden: '' });
    const made = element('div', { class: 'view', style: `width:${picture.columns}px;aspect-ratio:${picture.columns}/${picture.rows}` }, [
      element('img', { alt: text, 'data-picture': picture.picture }),
      element('img', { alt: '', class: 'layer', 'data-picture': picture.marks }), cursor]);
    this.observer.observe(made);
    return { made, cursor, picture };
  }

  load(view) {
    this.observer.unobserve(view);
    view.querySelectorAll('img:not([src])').forEach((one) => {
      one.src = `data:image/png;base64,${byId(`picture-${one.dataset.picture}`).textContent}`;
    });
  }

  /** Pixels of the picture where a click was. */
  pixelOf(view, event) {
    const box = view.made.getBoundingClientRect();
    return [(event.clientX - box.left) / box.width * view.picture.columns - 0.5,
      (event.clientY - box.top) / box.height * view.picture.rows - 0.5];
  }

  /** The pictures of a vessel that there are: each with the mm along it of a pixel, and where the cursor of a place is, x, y and kind. */
  picturesOf(vessel) {
    const { straightened, curved, slab } = vessel;
    const nearest = (points, x, y) => {
      const distances = points.map((point) => Math.hypot(point[0] - x, point[1] - y));
      return distances.indexOf(Math.min(...distances));
    };
    return [
      straightened && { view: this.view(straightened, `${vessel.name}, straightened`),
        arcOf: (x) => Math.round((x - straightened.left) / straightened.per_mm),
        cursorAt: (arc) => [straightened.left + straightened.per_mm * arc, 0, 'across'] },
      curved && { view: this.view(curved, `${vessel.name}, curved reformat`),
        arcOf: (x, y) => nearest(curved.axis, x, y), cursorAt: (arc) => [...curved.axis[arc], 'ring'] },
      slab && { view: this.view(slab, `${vessel.name} in a slab that follows it`),
        arcOf: (x, y) => nearest(vessel.path.map((place) => this.project(slab, place)), x, y),
        cursorAt: (arc, place) => [...this.project(slab, place).slice(0, 2), 'ring'] },
    ].filter(Boolean);
  }

  vessel(vessel, index) {
    const notes = [`${vessel.length.toFixed(1)} mm`];
    if (vessel.bridged > 0) {
      notes.push(element('b', { class: 'bridged' }, [`${vessel.bridged.toFixed(1)} mm bridged`]));
    }
    if (vessel.edited > 0) {
      notes.push(element('b', {}, [`${vessel.edited.toFixed(1)} mm by hand`]));
    }
    if (vessel.interpolated > 0) {
      notes.push(`radius guessed on ${vessel.interpolated.toFixed(1)} mm`);
    }
    if (vessel.stenosis > 0) {
      notes.push(element('b', {}, [`narrowed by ${(100 * vessel.stenosis).toFixed(0)} %`]));
    }
    const goTo = (arc) => this.onPlace(vessel.path[Math.max(0, Math.min(vessel.path.length - 1, arc))], false);
    const pictures = this.picturesOf(vessel);
    const section = vessel.sections ? new SectionView(vessel, this.observer, goTo) : null;
    const measured = this.run.cycle && new CycleView(this.run.cycle, index, goTo);
    const cycle = measured && !measured.empty ? measured : null;
    const scrolled = pictures.map(({ view }) => element('div', { class: 'scroll' }, [view.made]));
    scrolled.splice(1, 0, ...(section ? [section.made] : []));
    const article = element('article', { 'data-vessel': index }, [
      element('h3', {}, [vessel.name, ...notes.flatMap((one) => [' · ', one]).map((one) =>
        (typeof one === 'string' ? element('small', {}, [one]) : one))]), ...scrolled, ...(cycle ? [cycle.made] : [])]);
    pictures.forEach(({ view, arcOf }) => view.made.addEventListener('click', (event) => goTo(arcOf(...this.pixelOf(view, event)))));
    this.figures.push({ vessel, article, pictures, section, cycle });
    return article;
  }

  sheet(sheet) {
    const view = this.view(sheet, `${sheet.name} slabs through the heart`);
    view.made.addEventListener('click', (event) => {
      const [x, y] = this.pixelOf(view, event);
      const tile = sheet.tiles.find((one) => x >= one.left && x < one.left + one.width && y >= one.top && y < one.top + one.height);
      if (tile) {
        this.onPlace(tile.corner.map((value, k) =>
          value + tile.spacing * ((x - tile.left) * tile.right[k] + (y - tile.top) * tile.down[k])), false);
      }
    });
    this.sheets.push(view);
    return element('article', {}, [element('h3', {}, [`${sheet.name[0].toUpperCase()}${sheet.name.slice(1)}`,
      element('small', {}, [` ${sheet.tiles.length} slabs`])]), element('div', { class: 'scroll' }, [view.made])]);
  }

  /** Pixels of a slab's picture, and mm from its plane. */
  project(plane, place) {
    const from = place.map((value, k) => value - plane.corner[k]);
    return [dot(from, plane.right) / plane.spacing, dot(from, plane.down) / plane.spacing, dot(from, cross(plane.down, plane.right))];
  }

  /** The vessel at a place: its name, mm along it, mm from its axis; null: none is near. */
  nearest(place) {
    let best = null;
    for (const vessel of this.run ? this.run.vessels : []) {
      vessel.path.forEach((one, arc) => {
        const distance = away(one, place);
        if (!best || distance < best.distance) {
          best = { vessel, arc, distance };
        }
      });
    }
    return best && best.distance <= NEAR_VESSEL ? best : null;
  }

  /** @param fraction  of R-R, of the phase that is shown */
  atTime(fraction) {
    this.figures.filter(({ cycle }) => cycle).forEach(({ cycle }) => cycle.atTime(fraction));
  }

  /** Cursors in all pictures that have the place in them. */
  mark(place) {
    if (!this.run) {
      return;
    }
    const near = place && this.nearest(place);
    const put = (view, x, y, kind) => {
      view.cursor.hidden = false;
      view.cursor.className = `cursor ${kind}`;
      view.cursor.style.left = `${100 * (x + 0.5) / view.picture.columns}%`;
      view.cursor.style.top = kind === 'across' ? `${100 * view.picture.top / view.picture.rows}%` : `${100 * (y + 0.5) / view.picture.rows}%`;
      view.cursor.style.height = kind === 'across' ? `${100 * (view.picture.bottom - view.picture.top) / view.picture.rows}%` : '';
    };
    for (const { vessel, article, pictures, section, cycle } of this.figures) {
      const here = near && near.vessel === vessel;
      article.classList.toggle('here', Boolean(here));
      pictures.forEach(({ view }) => { view.cursor.hidden = true; });
      if (here) {
        pictures.forEach(({ view, cursorAt }) => put(view, ...cursorAt(near.arc, place)));
        for (const one of [section, cycle].filter(Boolean)) {
          one.show(near.arc);
        }
      }
    }
    for (const view of this.sheets) {
      const places = place ? view.picture.tiles.map((tile) => [tile, this.project(tile, place)]) : [];
      const [tile, at] = places.reduce((best, one) => (!best || Math.abs(one[1][2]) < Math.abs(best[1][2]) ? one : best), null) || [null, null];
      const inside = tile && at[0] >= 0 && at[1] >= 0 && at[0] < tile.width && at[1] < tile.height;
      view.cursor.hidden = !inside;
      if (inside) {
        put(view, tile.left + at[0], tile.top + at[1], 'ring');
      }
    }
  }
}

