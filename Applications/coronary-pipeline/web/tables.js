// Table 1, ours beside the paper's.

function written(value, digits = 3) {
  return known(value) ? value.toFixed(digits) : '–';
}

function meanAndDeviation(mean, deviation, digits = 3) {
  return known(deviation) ? `${written(mean, digits)} ± ${written(deviation, digits)}` : written(mean, digits);
}

/** A measure's name, which may break after an underscore, and its unit. */
function heading(column, kind = null) {
  const [first, ...rest] = column.key.split('_');
  const name = element('span', {}, [first, ...rest.flatMap((part) => ['_', element('wbr'), part])]);
  return element('th', { scope: 'col', class: kind },
    column.unit ? [name, element('small', {}, [` ${column.unit}`])] : [name]);
}

function cell(text, kind = null) {
  return element('td', { class: kind }, [text]);
}

/** Measures that the rows have: those of the paper, or all. */
function columnsOf(data, rows, all) {
  return data.columns.filter((column) =>
    (all || known(data.paper.part_a.mean[column.key])) && rows.some((row) => known(row[column.key])));
}

/** A row a phase; `onPhase` is called with the index of the phase whose row is clicked. */
function fillPartA(table, data, index, all, onPhase) {
  const one = data.table1.cases[index];
  const paperRows = data.cases[index].paper;
  const columns = columnsOf(data, one.phases, all);
  const paperColumns = columnsOf(data, [data.paper.part_a.mean], false);
  const head = element('thead', {}, [element('tr', { class: 'group' }, [
    element('td', { colspan: 3 }), element('th', { scope: 'colgroup', colspan: columns.length }, ['this model']),
    element('th', { scope: 'colgroup', colspan: paperColumns.length, class: 'paper' }, ['the paper’s case 1'])]),
  element('tr', {}, [
    element('th', { scope: 'col' }, ['Phase']), element('th', { scope: 'col' }, ['%R-R']),
    element('th', { scope: 'col', class: 'text' }, ['Kind']),
    ...columns.map((column) => heading(column)), ...paperColumns.map((column) => heading(column, 'paper'))])]);
  const body = element('tbody');
  one.phases.forEach((phase, k) => {
    const kind = kindOf(phase);
    const button = element('button', { type: 'button', 'aria-label': `Go to phase ${phase.phase}` }, [`${phase.phase}`]);
    const row = element('tr', { class: kind, 'data-phase': k }, [
      element('th', { scope: 'row' }, [button]),
      cell(phase.fraction === null ? '–' : (100 * phase.fraction).toFixed(1)), cell(kind, 'text kind'),
      ...columns.map((column) => cell(written(phase[column.key]))),
      ...paperColumns.map((column) => cell(written(paperRows[k][column.key], 2), 'paper'))]);
    row.addEventListener('click', () => onPhase(k));
    body.append(row);
  });
  const foot = element('tfoot');
  const sum = (name, ours, papers) => foot.append(element('tr', {}, [
    element('th', { scope: 'row', colspan: 3, class: 'text' }, [name]),
    ...columns.map((column) => cell(written(ours[column.key]))),
    ...paperColumns.map((column) => cell(papers ? written(papers[column.key], 2) : '–', 'paper'))]));
  sum('Mean, interpolated', one.interpolated_mean, data.paper.part_a.mean);
  sum('STD, interpolated', one.interpolated_deviation, data.paper.part_a.deviation);
  sum('Mean, tracked', one.tracked_mean, null);
  sum('STD, tracked', one.tracked_deviation, null);
  table.replaceChildren(
    element('caption', {}, ['A row goes to its phase. The paper has numbers for its interpolated phases.']),
    head, body, foot);
}

/** A row a case, then the paper's; `onCase` is called with the index of the case whose row is clicked. */
function fillPartB(table, data, all, onCase) {
  const cases = data.table1.cases;
  const columns = columnsOf(data, cases.flatMap((one) => one.phases), all);
  const head = element('thead', {}, [element('tr', {}, [
    element('th', { scope: 'col', class: 'text' }, ['Case']), ...columns.map((column) => heading(column))])]);
  const body = element('tbody');
  cases.forEach((one, k) => {
    const button = element('button', { type: 'button', 'aria-label': `Go to case ${one.name}` }, [one.name]);
    const row = element('tr', { 'data-case': k }, [element('th', { scope: 'row', class: 'text' }, [button]),
      ...columns.map((column) => cell(meanAndDeviation(one.interpolated_mean[column.key], one.interpolated_deviation[column.key])))]);
    row.addEventListener('click', () => onCase(k));
    body.append(row);
  });
  if (cases.length > 1) {
    body.append(element('tr', { class: 'sum' }, [element('th', { scope: 'row', class: 'text' }, ['Mean of the cases']),
      ...columns.map((column) => cell(meanAndDeviation(data.table1.mean[column.key], data.table1.deviation[column.key])))]));
  }
  const paper = element('tbody', { class: 'paper' });
  for (const one of data.paper.cases) {
    paper.append(element('tr', {}, [element('th', { scope: 'row', class: 'text' }, [`paper, ${one.name}`]),
      ...columns.map((column) => cell(written(one.mean[column.key], 2)))]));
  }
  paper.append(element('tr', { class: 'sum' }, [element('th', { scope: 'row', class: 'text' }, ['paper, mean']),
    ...columns.map((column) => cell(meanAndDeviation(data.paper.part_b.mean[column.key], data.paper.part_b.deviation[column.key], 2)))]));
  table.replaceChildren(
    element('caption', {}, ['Means over the interpolated phases of each case. Grey: the paper’s Part B, of other data.']),
    head, body, paper);
}

// What the table of branches has: measure, unit, what of its values over the phases, digits.
const BRANCH_COLUMNS = [['length', 'mm', 'mean', 1], ['covered', '', 'mean', 3], ['covered', '', 'least', 3],
  ['continuity', '', 'mean', 3], ['continuity', '', 'least', 3], ['mean', 'mm', 'mean', 3], ['HD', 'mm', 'mean', 3],
  ['HD', 'mm', 'greatest', 3]];
const BRANCH_NAMES = { mean: 'distance' };
const OVER_PHASES = {
  mean: (values) => values.reduce((sum, value) => sum + value, 0) / values.length,
  least: (values) => Math.min(...values),
  greatest: (values) => Math.max(...values),
};

/** A row a branch of the truth, over all phases. @param phases  the branches of each @return whether there are any */
function fillBranches(table, phases) {
  const branches = new Map();
  for (const one of phases.flat()) {
    branches.set(one.group, [...(branches.get(one.group) || []), one]);
  }
  const body = element('tbody');
  for (const [group, all] of [...branches].sort((a, b) => a[0] - b[0])) {
    const label = (all.find((one) => one.label) || { label: '–' }).label;
    body.append(element('tr', {}, [element('th', { scope: 'row', class: 'text' }, [label]), cell(`${group}`), cell(`${all.length}`),
      ...BRANCH_COLUMNS.map(([key, , what, digits]) => {
        const values = all.map((one) => one[key]).filter(known);
        return cell(values.length > 0 ? written(OVER_PHASES[what](values), digits) : '–');
      })]));
  }
  table.replaceChildren(
    element('caption', {}, ['Over all phases: what the model has of the truth’s branches, and how far their surface is from it.']),
    element('thead', {}, [element('tr', {}, [element('th', { scope: 'col', class: 'text' }, ['Branch']),
      ...['group', 'phases'].map((name) => element('th', { scope: 'col' }, [name])),
      ...BRANCH_COLUMNS.map(([key, unit, what]) => element('th', { scope: 'col' }, [BRANCH_NAMES[key] || key,
        element('small', {}, [` ${what}${unit ? `, ${unit}` : ''}`])]))])]), body);
  return branches.size > 0;
}
