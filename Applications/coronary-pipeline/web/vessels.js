// What a run says of itself: warnings, what was guessed, findings, and its vessels in the image.

const FINDINGS = [
  ['checks', 'Checks of the whole tree', 'Nothing was noticed.'],
  ['bridges', 'Guessed across gaps', 'No gap was bridged.'],
  ['lesions', 'Narrowings', 'No narrowing was found.'],
  ['calcium', 'Calcium', 'No calcium was found.'],
];
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

/** "length_mm" becomes "length" and "mm". */
function wordsOf(key) {
  const [, name, unit] = key.match(/^(.*?)(?:_(mm3|mm2|mm|hu|HU|ml))?$/);
  return { name: name.replace(/_/g, ' '), unit: unit ? unit.replace('3', '³').replace('2', '²').replace('hu', 'HU') : '' };
}

function shownValue(key, value) {
  if (known(value)) {
    const share = /degree|stenosis/.test(key) && !/_mm/.test(key) && Math.abs(value) <= 1;
    return share ? `${(100 * value).toFixed(0)} %` : Number.isInteger(value) ? `${value}` : value.toFixed(2);
  }
  return typeof value === 'string' ? value : typeof value === 'boolean' ? (value ? 'yes' : 'no') : '–';
}

/** A row a finding with all that it says in words and numbers. */
function fillFindings(table, findings, onPlace) {
  const plain = (value) => value !== null && typeof value !== 'object';
  const keys = [...new Set(findings.flatMap((one) => Object.keys(one).filter((key) => plain(one[key]))))];
  const texts = new Set(keys.filter((key) => findings.every((one) => typeof one[key] !== 'number')));
  const head = element('thead', {}, [element('tr', {}, [
    ...keys.map((key) => {
      const { name, unit } = wordsOf(key);
      return element('th', { scope: 'col', class: texts.has(key) ? 'text' : null }, unit ? [name, element('small', {}, [` ${unit}`])] : [name]);
    }), element('th', { scope: 'col' }, ['place'])])]);
  const body = element('tbody');
  findings.forEach((one) => {
    const place = placeOf(one);
    const cells = keys.map((key) => cell(shownValue(key, one[key]), texts.has(key) ? 'text' : null));
    const button = place ? element('button', { type: 'button' }, ['show']) : '–';
    const row = element('tr', { class: place ? 'goes' : null }, [...cells, element('td', {}, [button])]);
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
    addEventListener('beforeprint', () => document.querySelectorAll('.view').forEach((one) => this.load(one)));
  }

  /** @param run  null: the case is not of a run */
  fill(run) {
    this.run = run;
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
    byId('findings').replaceChildren(...FINDINGS.map(([kind, title, none]) => this.findings(kind, title, none)));
    const pictured = run.vessels.some((one) => one.straightened);
    byId('vessel-views').hidden = !pictured;
    byId('heart-sheets').hidden = run.sheets.length === 0;
    byId('views').replaceChildren(...(pictured ? run.vessels.map((one, k) => this.vessel(one, k)) : []));
    byId('sheets').replaceChildren(...run.sheets.map((one) => this.sheet(one)));
    if (pictured) {
      byId('views-note').textContent = `Two cuts at right angles, ±${run.half_width} mm about the axis, then diameter (mm) and the ` +
        `image’s values on the axis; below them a slab of ${run.thickness} mm that follows the vessel. Black ${run.window[0].toFixed(0)}, ` +
        `white ${run.window[1].toFixed(0)} (HU). A click shows the place in the model.`;
    }
  }

  findings(kind, title, none) {
    const found = this.run[kind];
    const parts = [element('h3', {}, [title])];
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

  vessel(vessel, index) {
    const straight = this.view(vessel.straightened, `${vessel.name}, straightened`);
    const slab = this.view(vessel.slab, `${vessel.name} in a slab that follows it`);
    const notes = [`${vessel.length.toFixed(1)} mm`];
    if (vessel.bridged > 0) {
      notes.push(element('b', { class: 'bridged' }, [`${vessel.bridged.toFixed(1)} mm bridged`]));
    }
    if (vessel.interpolated > 0) {
      notes.push(`radius guessed on ${vessel.interpolated.toFixed(1)} mm`);
    }
    if (vessel.stenosis > 0) {
      notes.push(element('b', {}, [`narrowed by ${(100 * vessel.stenosis).toFixed(0)} %`]));
    }
    const article = element('article', { 'data-vessel': index }, [
      element('h3', {}, [vessel.name, ...notes.flatMap((one) => [' · ', one]).map((one) =>
        (typeof one === 'string' ? element('small', {}, [one]) : one))]),
      element('div', { class: 'scroll' }, [straight.made]), element('div', { class: 'scroll' }, [slab.made])]);
    straight.made.addEventListener('click', (event) => {
      const arc = (this.pixelOf(straight, event)[0] - vessel.straightened.left) / vessel.straightened.per_mm;
      this.onPlace(vessel.path[Math.max(0, Math.min(vessel.path.length - 1, Math.round(arc)))], false);
    });
    slab.made.addEventListener('click', (event) => {
      const [x, y] = this.pixelOf(slab, event);
      const distances = vessel.path.map((place) => {
        const [px, py] = this.project(vessel.slab, place);
        return Math.hypot(px - x, py - y);
      });
      this.onPlace(vessel.path[distances.indexOf(Math.min(...distances))], false);
    });
    this.figures.push({ vessel, article, straight, slab });
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
    for (const { vessel, article, straight, slab } of this.figures) {
      const here = near && near.vessel === vessel;
      article.classList.toggle('here', Boolean(here));
      straight.cursor.hidden = !here;
      slab.cursor.hidden = !here;
      if (here) {
        put(straight, straight.picture.left + straight.picture.per_mm * near.arc, 0, 'across');
        const [x, y] = this.project(slab.picture, place);
        put(slab, x, y, 'ring');
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

