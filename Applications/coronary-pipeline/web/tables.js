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

// What the table of branches has: measure, unit, what of its values over the phases, digits, and whether there is room only on a wide page.
const BRANCH_COLUMNS = [['length', 'mm', 'mean', 1, 'wide'], ['covered', '%', 'mean', 0, 'wide'], ['covered', '%', 'least', 0, null],
  ['mean', 'mm', 'mean', 2, null], ['HD', 'mm', 'greatest', 2, null]];
const BRANCH_NAMES = { covered: 'found', mean: 'distance' };
const LOST_SHARE = 0.5; // of a branch's length: less of it is a lost branch
const OVER_PHASES = {
  mean: (values) => values.reduce((sum, value) => sum + value, 0) / values.length,
  least: (values) => Math.min(...values),
  greatest: (values) => Math.max(...values),
};

/** The branches of the truth, the worst first: { group, label, values, worst }; worst is the index of the phase in which it is furthest off. */
function branchesOf(phases) {
  const branches = new Map();
  phases.forEach((list, phase) => list.forEach((one) => {
    const branch = branches.get(one.group) || { group: one.group, label: one.label || '–', all: [], worst: phase };
    const worse = (a, b) => (known(a.HD) ? a.HD : Infinity) > (known(b.HD) ? b.HD : Infinity) || (!known(a.HD) && a.covered < b.covered);
    const before = branch.all.find((entry) => entry.phase === branch.worst);
    branch.all.push({ ...one, phase });
    branch.worst = !before || worse(one, before) ? phase : branch.worst;
    branches.set(one.group, branch);
  }));
  const least = (branch) => Math.min(...branch.all.map((one) => one.covered));
  const greatest = (branch) => Math.max(...branch.all.map((one) => (known(one.HD) ? one.HD : 0)));
  return [...branches.values()].sort((a, b) => Math.min(LOST_SHARE, least(a)) - Math.min(LOST_SHARE, least(b)) || greatest(b) - greatest(a));
}

/** A row a branch of the truth, over all phases; `onBranch` is called with the branch whose row is clicked. @return whether there are any */
function fillBranches(table, phases, names, onBranch) {
  const branches = branchesOf(phases);
  const body = element('tbody');
  for (const branch of branches) {
    const button = element('button', { type: 'button', 'aria-label': `Show ${branch.label}` }, [branch.label]);
    const row = element('tr', { class: Math.min(...branch.all.map((one) => one.covered)) < LOST_SHARE ? 'goes missed' : 'goes', 'data-branch': branch.group }, [
      element('th', { scope: 'row', class: 'text' }, [button]),
      ...BRANCH_COLUMNS.map(([key, unit, what, digits, kind]) => {
        const values = branch.all.map((one) => one[key]).filter(known);
        return cell(values.length > 0 ? written((unit === '%' ? 100 : 1) * OVER_PHASES[what](values), digits) : '–', kind);
      }), cell(names[branch.worst])]);
    row.addEventListener('click', () => onBranch(branch));
    body.append(row);
  }
  table.replaceChildren(
    element('caption', {}, ['The truth’s branches over all phases, the worst first: how much of their length the model has, and how far their surface is from ' +
      'it. A row goes to the branch in its worst phase.']),
    element('thead', {}, [element('tr', {}, [element('th', { scope: 'col', class: 'text' }, ['Branch']),
      ...BRANCH_COLUMNS.map(([key, unit, what, , kind]) => element('th', { scope: 'col', class: kind }, [BRANCH_NAMES[key] || key,
        element('small', {}, [` ${what === 'mean' && key === 'length' ? '' : what}${unit ? ` ${unit}` : ''}`])])),
      element('th', { scope: 'col' }, ['worst', element('small', {}, [' phase'])])])]), body);
  return branches.length > 0;
}
