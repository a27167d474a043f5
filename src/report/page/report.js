'use strict';
// Lays out the content of #data: material.json, run.json, report.json, prediction.json and the pictures of one result folder.
const {material, run, report, prediction, pictures} = JSON.parse(document.getElementById('data').textContent);

/// An element with properties and children; texts become text, never markup.
function make(tag, properties, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties ?? {})) {
    if (name in element) element[name] = value;
    else element.setAttribute(name, value);
  }
  element.append(...children.flat().filter(child => child != null));
  return element;
}
const number = (v, digits = 3) => v == null ? 'none' : String(Number(v.toPrecision(digits)));
const fixed = (v, places = 2) => v == null ? 'none' : v.toFixed(places);
const percent = v => v == null ? 'none' : `${Math.round(100 * v)} %`;
const signed = v => Math.abs(v) < .05 ? '0.0' : (v > 0 ? '+' : '−') + Math.abs(v).toFixed(1);
const list = items => make('ul', {}, items.map(item => make('li', {}, item)));
const row = (cells, tag = 'td') => make('tr', {}, cells.map(cell =>
    cell instanceof Node ? cell : make(tag, typeof cell === 'number' ? {className: 'n'} : {}, String(cell))));
const figureCell = text => make('td', {className: 'n'}, text);
/// Heads are aligned with their columns: to the right for figures.
const table = (heads, rows) => make('div', {className: 'wide'}, make('table', {},
    make('thead', {}, row(heads.map((head, i) => make('th', {scope: 'col', className: rows[0]?.cells[i].className ?? ''}, head)))),
    make('tbody', {}, rows)));
/// "dentine.absorption_per_mm[B]" in everyday words.
const plainName = name => name.replace('.', ' ').replace('_per_mm', '').replace('_mm', '').replaceAll('_', ' ').replace('[', ' ').replace(']', '');
const unitOf = key => key.endsWith('_per_mm') ? '1/mm' : key.endsWith('_mm') ? 'mm' : '';

const main = document.querySelector('main');
function section(id, title, ...children) {
  const part = make('section', {id}, make('h2', {}, title), ...children);
  main.append(part);
  return part;
}

function showVerdict() {
  const verdict = document.getElementById('verdict'), usable = material.status === 'usable';
  verdict.className = material.status;
  verdict.replaceChildren(make('h2', {}, (usable ? '✓ ' : '✕ ') + report.headline));
  const part = (title, items) => items.length && verdict.append(make('h3', {}, title), list(items));
  if (!usable) part('Reasons', material.reasons);
  verdict.append(list(report.sentences));
  if (usable) part('Points to check', material.reasons);
  part('Photographs that would help', report.photographs_that_would_help);
  part('Caveats', material.caveats);
}

function wipe(photograph) {
  const {pictures: files, name} = photograph;
  const size = {width: files.width, height: files.height};
  const stack = make('div', {className: 'stack'},
      make('img', {src: pictures[files.prediction], alt: `Prediction of ${name}`, ...size}),
      make('img', {src: pictures[files.photograph], alt: `Photograph ${name}`, className: 'first', ...size}));
  const slider = make('input', {type: 'range', min: 0, max: 100, step: 1, value: 50,
                                'aria-label': `Wipe ${name}: how much of the photograph is shown`});
  const show = () => {
    stack.style.setProperty('--at', `${slider.value}%`);
    slider.setAttribute('aria-valuetext', `${slider.value} % photograph, the rest prediction`);
  };
  slider.addEventListener('input', show);
  const follow = event => {
    const box = stack.getBoundingClientRect();
    slider.value = 100 * (event.clientX - box.left) / box.width;
    show();
  };
  stack.addEventListener('pointerdown', event => {
    stack.setPointerCapture(event.pointerId);
    follow(event);
  });
  stack.addEventListener('pointermove', event => event.buttons && follow(event));
  show();
  return make('figure', {className: 'wipe'}, stack, slider,
      make('div', {className: 'ends'}, make('span', {}, 'photograph'), make('span', {}, 'prediction')));
}

function zoneTable(zones) {
  if (!zones.length)
    return make('p', {className: 'soft'},
        'No thirds are shown, because the capture does not say which end of the crown is incisal. State "long_axis" in its "object".');
  return table(['third', 'the prediction is', 'ΔE₀₀ of means', 'ΔL*', 'Δa*', 'Δb*', 'median ΔE₀₀', 'photograph L* a* b*'],
      zones.map(zone => row([
        zone.zone, zone.prediction_is, figureCell(fixed(zone.de00_of_means)), ...zone.off_lab.map(v => figureCell(signed(v))),
        figureCell(fixed(zone.de00_median)), figureCell(zone.photograph_lab.map(v => v.toFixed(1)).join('  '))])));
}

function showPhotographs() {
  if (!report.photographs.length) return;
  const colour = rgb => `rgb(${rgb.map(v => Math.round(255 * v)).join(' ')})`;
  const legend = make('ul', {className: 'legend'}, report.difference_legend.map(step => {
    const patch = make('i');
    patch.style.background = colour(step.rgb);
    return make('li', {}, patch, step.label);
  }));
  section('photographs', 'Photographs',
      make('p', {className: 'soft screen'}, 'Move the slider, or drag over the picture.'),
      make('p', {className: 'soft'}, 'Map and figures show CIEDE2000 (D65, 2°) between means over 8 × 8 pixels, ' +
          'so that noise of single pixels does not count as a colour difference. Differences are prediction minus photograph.'),
      legend,
      report.photographs.map(photograph => {
        const error = material.image_error.photographs[photograph.name] ?? {};
        return make('article', {className: 'photograph'},
            make('h3', {}, photograph.name + (photograph.use === 'holdout' ? ' (held out: the fit never saw it)' : '')),
            make('div', {className: 'pictures'}, wipe(photograph),
                make('figure', {}, make('img', {src: pictures[photograph.pictures.difference], alt: `CIEDE2000 map of ${photograph.name}`,
                                                width: photograph.pictures.width, height: photograph.pictures.height}),
                    make('figcaption', {}, 'CIEDE2000'))),
            make('p', {}, `ΔE₀₀ median ${fixed(error.de00_median)}, 95 % below ${fixed(error.de00_p95)}; ` +
                `${percent(error.share_below_pt)} not seen (0.8), ${percent(error.share_below_at)} acceptable (1.8); ` +
                `reduced χ² ${fixed(error.reduced_chi2)}; photograph / prediction brightness ${fixed(photograph.level, 3)}` +
                (photograph.saturated_pixels ? `; ${photograph.saturated_pixels} saturated pixels left out.` : '.')),
            zoneTable(photograph.zones));
      }));
}

function showMeasurements() {
  if (!material.measurements?.length) return;
  const channels = material.channels.map(channel => channel.name), names = {lab: ['L*', 'a*', 'b*']};
  const rows = material.measurements.flatMap(reading => reading.value.map((value, i) => row([
    reading.name + (reading.use === 'holdout' ? ' (held out)' : ''), `${reading.quantity} ${(names[reading.quantity] ?? channels)[i]}`,
    figureCell(number(value, 4)), figureCell(number(reading.stddev[i], 2)), figureCell(number(reading.predicted[i], 4)),
    figureCell(signed((reading.predicted[i] - value) / reading.stddev[i]))])));
  section('measurements', 'Measurements of flat samples',
      make('p', {className: 'soft'}, 'Difference: (prediction − reading) / standard deviation of the reading. One in twenty is expected beyond ±2.'),
      table(['measurement', 'quantity', 'reading', 'standard deviation', 'prediction', 'difference'], rows));
}

/// One line per value of every parameter.
function parameterLines() {
  const lines = [], channels = material.channels.map(channel => channel.name);
  const add = (owner, key, parameter) => {
    if (!parameter?.status) return;  // a name
    const values = [parameter.value].flat();
    values.forEach((value, i) => lines.push({
      id: `${owner}.${key}` + (values.length > 1 ? `[${channels[i]}]` : ''), unit: unitOf(key), value,
      stddev: [parameter.stddev].flat()[i], interval: values.length > 1 ? parameter.interval95?.[i] : parameter.interval95,
      status: parameter.status_by_channel?.[i] ?? parameter.status}));
  };
  for (const layer of material.layers) for (const [key, parameter] of Object.entries(layer)) add(layer.name, key, parameter);
  for (const [key, parameter] of Object.entries(material.surface)) add('surface', key, parameter);
  return lines;
}

// Charts are drawn again when the colours of the page change.
const charts = [];
function chart(label, height, configuration) {
  const canvas = make('canvas', {role: 'img', 'aria-label': label});
  const box = make('div', {className: 'chart'}, canvas);
  box.style.height = `${height}px`;
  charts.push({canvas, configuration});
  return box;
}
function paint() {
  const style = getComputedStyle(document.documentElement), colour = name => style.getPropertyValue(name).trim();
  const palette = Object.fromEntries(['ink', 'soft', 'line', 'good', 'bad', 'accent', 'second'].map(name => [name, colour(`--${name}`)]));
  Object.assign(Chart.defaults, {color: palette.ink, borderColor: palette.line, animation: false, maintainAspectRatio: false, devicePixelRatio: 2});
  for (const {canvas, configuration} of charts) {
    Chart.getChart(canvas)?.destroy();
    new Chart(canvas, configuration(palette));
  }
}
const axis = (text, more) => ({title: {display: true, text}, ...more});
const shortTicks = {callback: v => number(v), maxRotation: 0, autoSkip: true, autoSkipPadding: 12, maxTicksLimit: 6};
/// Ticks at 1, 2 and 5 of every decade; with many decades at the start of each, or of every second one.
const decadeTicks = {maxRotation: 0, autoSkip: false, callback: (v, index, ticks) => {
  const decades = Math.log10(ticks.at(-1).value / ticks[0].value);
  return (decades < 2.5 ? /^[125]e/ : decades < 7 ? /^1e/ : /^1e[+-]\d?[02468]$/).test(v.toExponential()) ? number(v) : '';
}};

function showParameters() {
  const lines = parameterLines(), known = lines.filter(line => line.interval), drawn = known.filter(line => line.interval[1] > 0);
  const colourOf = {fitted: 'accent', prior: 'second', not_identified: 'bad', at_bound: 'bad'};
  const floor = Math.min(...drawn.flatMap(line => [line.interval[0], line.value]).filter(v => v > 0));
  const part = section('parameters', 'Parameters',
      make('p', {className: 'soft'}, 'Bars are 95 % intervals on one logarithmic axis; dots are values. Blue: fitted. Orange: held by the prior. ' +
          'Red: not identified, or at a bound. The intervals are valid if the model holds.'));
  if (drawn.length)
    part.append(chart('95 % intervals of the parameters; the table below has the figures', 70 + 22 * drawn.length, palette => ({
      type: 'bar',
      data: {labels: drawn.map(line => plainName(line.id) + (line.unit && `, ${line.unit}`)),
             datasets: [
               {type: 'line', showLine: false, data: drawn.map(line => line.value), pointRadius: 4, borderColor: palette.ink, backgroundColor: palette.ink},
               {data: drawn.map(line => [Math.max(line.interval[0], floor), line.interval[1]]), minBarLength: 3, barPercentage: .5,
                backgroundColor: drawn.map(line => palette[colourOf[line.status] ?? 'soft'])}]},
      options: {indexAxis: 'y', plugins: {legend: {display: false}, tooltip: {enabled: false}},
                scales: {x: {type: 'logarithmic', ticks: decadeTicks}, y: {ticks: {autoSkip: false}}}}})));
  part.append(table(['parameter', 'unit', 'value', 'standard deviation', '95 % interval', 'status'], known.map(line => row([
    plainName(line.id), line.unit, figureCell(number(line.value, 4)), figureCell(number(line.stddev, 2)),
    `${number(line.interval[0])} to ${number(line.interval[1])}`, line.status.replace('_', ' ')]))));
  const held = lines.filter(line => !line.interval);
  if (held.length)
    part.append(make('details', {}, make('summary', {}, 'Held fixed'),
        list(held.map(line => `${plainName(line.id)}: ${number(line.value, 4)} ${line.unit}`))));
}

/// Values of more than three channels as curves over wavelength, with their 95 % intervals.
function showSpectra() {
  const order = material.channels.map((_, i) => i).sort((a, b) => material.channels[a].wavelength_nm - material.channels[b].wavelength_nm);
  if (order.length < 4) return;
  const curves = material.layers.flatMap(layer => Object.entries(layer)
      .filter(([, parameter]) => Array.isArray(parameter?.value) && parameter.value.length === order.length)
      .map(([key, parameter]) => ({name: plainName(`${layer.name}.${key}`) + `, ${unitOf(key)}`, ...parameter})));
  if (!curves.length) return;
  const points = values => order.map(i => ({x: material.channels[i].wavelength_nm, y: values[i] ?? null}));
  const part = section('spectra', 'Spectra',
      make('p', {className: 'soft'}, 'Dots are the values of the channels; the band is their 95 % interval.'));
  part.append(make('div', {className: 'profiles'}, curves.map(curve => make('figure', {}, chart(`${curve.name} by wavelength`, 200, palette => ({
    type: 'line',
    data: {datasets: [
      {data: points(curve.value), borderColor: palette.accent, backgroundColor: palette.accent, pointRadius: 3},
      ...[0, 1].filter(() => curve.interval95).map(end => ({
        data: points(curve.interval95.map(interval => interval?.[end])), borderColor: 'transparent', pointRadius: 0,
        backgroundColor: palette.accent + '33', fill: end === 1 ? '-1' : false}))]},
    options: {plugins: {legend: {display: false}, tooltip: {enabled: false}},
              scales: {x: axis('nm', {type: 'linear', ticks: shortTicks}), y: {type: 'logarithmic', ticks: decadeTicks}}}})),
      make('figcaption', {}, curve.name)))));
}

function showCorrelation() {
  const {names, correlation} = material.joint;
  if (names.length < 2) return;
  const cell = r => {
    const box = figureCell(r == null ? '' : r.toFixed(2));
    // Partly transparent, so that the text stays readable on a light or dark page.
    box.style.background = `rgb(${r > 0 ? '178 24 43' : '33 102 172'} / ${.55 * Math.abs(r ?? 0)})`;
    return box;
  };
  const body = make('table', {className: 'correlation'},
      make('thead', {}, row([make('td'), ...names.map((_, i) => make('th', {scope: 'col'}, String(i + 1)))])),
      make('tbody', {}, names.map((name, i) => row([make('th', {scope: 'row'}, `${i + 1}  ${plainName(name)}`),
                                                       ...correlation[i].map(cell)]))));
  section('correlation', 'Correlation of the fitted parameters',
      make('p', {className: 'soft'}, 'Near ±1 only a combination of the two is known, not each of them. Red: raising both fits almost as well. ' +
          'Blue: raising one and lowering the other does. Data and priors together, on the scales of the fit (logarithmic where values are positive).'),
      make('div', {className: 'wide'}, body),
      material.identifiability.weak_directions.length
          ? make('details', {}, make('summary', {}, 'Weak directions'), list(material.identifiability.weak_directions)) : null);
}

function showProfiles() {
  if (!report.profiles.length) return;
  const by = (report.profiles.find(profile => profile.by !== 'parabola') ?? report.profiles[0]).by, stated = parameterLines();
  const part = section('profiles', 'Likelihood profiles of weakly determined parameters',
      make('p', {className: 'soft'}, (by === 'slopes'
          ? 'Growth of χ² when one parameter is held and all others are fitted again, integrated from derivatives at a few values. The pictures are random walks that switch to diffusion; their Monte Carlo noise may make a curve flatter than its interval. ' +
            'The 95 % intervals below also include errors that the model and all walks share, and other optima; the curves do not. The four weakest parameters have such curves. Others, and a roughness, have a parabola from the covariance.'
          : by === 'fits'
          ? 'Growth of χ² when one parameter is held and all others are fitted again (geometry as at the solution; χ² divided by the variance ' +
            'inflation). The 95 % intervals below reach further than where the curves cross 3.84: they include model errors that pixels share.'
          : 'Parabolas from the covariance of the fit, priors included. No fits were made for them.') +
          ' Dashed line: 3.84, the 95 % limit. Curves are drawn for intervals wider than a factor of 1.5.'));
  part.append(make('div', {className: 'profiles'}, report.profiles.map(profile => {
    const entry = report.entries.find(e => e.name === profile.entry), interval = stated.find(line => line.id === profile.entry)?.interval;
    const name = plainName(profile.entry) + (entry.unit === '1' ? '' : `, ${entry.unit}`);
    const ends = [profile.value[0], profile.value.at(-1)];
    return make('figure', {}, chart(`χ² profile of ${name}`, 200, palette => ({
      type: 'scatter',
      data: {datasets: [
        {data: profile.value.map((x, i) => ({x, y: profile.delta_chi2[i]})), showLine: true, cubicInterpolationMode: 'monotone', borderColor: palette.accent, backgroundColor: palette.accent,
         pointRadius: profile.by === 'fits' ? 3 : 0},
        {data: ends.map(x => ({x, y: 3.84})), showLine: true, borderColor: palette.second, borderDash: [5, 4], borderWidth: 1.5, pointRadius: 0}]},
      options: {plugins: {legend: {display: false}, tooltip: {enabled: false}},
                scales: {x: axis(name, {min: ends[0], max: ends[1], type: ends[1] > 3 * ends[0] && ends[0] > 0 ? 'logarithmic' : 'linear', ticks: shortTicks}),
                         y: axis('Δχ²', {min: 0, suggestedMax: 6})}}})),
      make('figcaption', {}, interval ? `95 % interval ${number(interval[0])} to ${number(interval[1])}` : ''));
  })));
}

function showConvergence() {
  const {shader, walks} = report.convergence;
  const part = section('convergence', 'Convergence');
  const points = (values, more) => ({data: values.map((y, x) => ({x: x + 1, y})), showLine: true, ...more});
  const options = (x, y, legend) => ({plugins: {legend: {display: legend}, tooltip: {enabled: false}},
      scales: {x: axis(x, {ticks: {precision: 0}}), y: axis(y, {type: 'logarithmic', ticks: decadeTicks})}});
  if (shader.length)
    part.append(chart('χ² by iteration', 220, palette => ({
      type: 'scatter',
      data: {datasets: [points(shader.map(i => i.reduced_chi2), {
        borderColor: palette.accent, pointRadius: 3,
        backgroundColor: shader.map(i => i.cast % 2 ? 'transparent' : palette.accent), pointBorderColor: palette.accent})]},
      options: options(material.model === 'layered' ? 'iteration' : 'iteration of model shader (fill changes when geometry is cast again)', 'reduced χ²', false)})));
  if (walks.length)
    part.append(chart('χ² by step of the path-traced fit', 220, palette => ({
      type: 'scatter',
      data: {datasets: [
        points(walks.map(s => s.block_chi2), {label: 'patches of 8 × 8 pixels', borderColor: palette.accent, backgroundColor: palette.accent,
                                              pointStyle: walks.map(s => s.stage === 'run' ? 'triangle' : 'circle'), pointRadius: 5}),
        points(walks.map(s => s.reduced_chi2), {label: 'pixels', borderColor: palette.second, backgroundColor: palette.second, pointRadius: 3})]},
      options: options('step of the path-traced fit (triangles: final runs)', 'χ² over that of noise', true)})));
  if (!shader.length && !walks.length) part.append(make('p', {}, 'Nothing was free to fit.'));
}

function showElsewhere() {
  if (!prediction) return;
  const title = 'As a flat piece';
  if (prediction.missing) return void section('elsewhere', title, make('p', {}, prediction.missing));
  const {assumptions, groups, nearest_tabs: tabs} = prediction, thickest = 8;
  const plain = v => v == null ? `over ${thickest}` : number(v);
  const withInterval = figure => make('td', {className: 'n'}, number(figure.value),
      figure.interval95 ? make('small', {}, make('br'), figure.interval95[0] == null ? 'no interval' : figure.interval95.map(v => number(v)).join(' to ')) : null);
  const total = group => Object.values(group.thickness_mm).reduce((sum, mm) => sum + mm, 0);
  const thickness = group => (group.name === 'design' ? 'design, ' : '') + `${fixed(total(group))} mm`;
  const colour = (group, over) => {
    const patch = make('i', {className: 'patch'}), of = key => group.figures[`over_${over}.${key}`].value;
    patch.style.background = `rgb(${['R', 'G', 'B'].map(c => Math.round(255 * of(`srgb_${c}`))).join(' ')})`;
    return make('td', {}, patch, ` ${['L', 'a', 'b'].map(c => of(c).toFixed(1)).join('  ')}`);
  };
  const [design] = groups;
  const part = section('elsewhere', title,
      make('p', {className: 'soft'}, `The fitted layers as a flat piece, ${Object.entries(design.thickness_mm).map(([name, mm]) => `${name} ${fixed(mm)} mm`).join(' and ')}, ` +
          'and scaled to other thicknesses. Colours are L* a* b*. TP₀₀ is CIEDE2000 between the piece over the black and over the white card. The contrast ratio is Y over black divided by Y over white. ' +
          '“Stump shows” is CIEDE2000 between the piece over the stump and over the target: seen from 0.8, accepted up to 1.8. Below a figure is its 95 % interval.'),
      table(['thickness', 'over black', 'over white', 'over the stump', 'TP₀₀', 'contrast ratio', 'stump shows'], groups.map(group => row([
        thickness(group), colour(group, 'black'), colour(group, 'white'), colour(group, 'stump'),
        withInterval(group.figures.tp00), withInterval(group.figures.contrast_ratio), withInterval(group.figures.stump_shows)]))));
  const {masked_from_pt: seen, masked_from_at: accepted, 'change_of_0.1_mm_less': less} = design.figures;
  part.append(list([
    `Thickness from which the stump is not seen: ${plain(seen.value)} mm; from which it is acceptable: ${plain(accepted.value)} mm.`,
    `A piece thinner by 0.1 mm differs over the stump by CIEDE2000 ${fixed(less.value, 1)}.`]));
  if (tabs)
    part.append(make('h3', {}, 'Nearest tabs, over the stump'), list(tabs.verdict),
        table(['tab', 'CIEDE2000', '95 % interval'], tabs.nearest.map(tab => row([
          tab.name, figureCell(fixed(tab.de00)), `${fixed(tab.interval95[0])} to ${fixed(tab.interval95[1])}`]))));
  const bands = [['reflectance', 'reflectance'], ['transmittance', 'transmittance'], ['kubelka_munk_k', 'Kubelka-Munk K, 1/mm'], ['kubelka_munk_s', 'Kubelka-Munk S, 1/mm']];
  part.append(
      make('details', {}, make('summary', {}, 'Reflectance, transmittance, Kubelka-Munk K and S'),
          table(['thickness', 'quantity', ...material.channels.map(channel => channel.name)], groups.flatMap(group => bands.map(([key, name]) => row([
            thickness(group), name, ...['R', 'G', 'B'].map(c => withInterval(group.figures[`${key}_${c}`]))]))))),
      make('details', {}, make('summary', {}, 'Assumptions'), list(assumptions)));
}

function showProvenance() {
  const {provenance} = material, facts = make('dl');
  const fact = (name, value) => facts.append(make('dt', {}, name), make('dd', {}, String(value)));
  fact('model', `${material.model}: ${provenance.model_choice}`);
  fact('reduced χ²', number(material.identifiability.reduced_chi2));
  fact('χ² of patches', number(material.identifiability.block_chi2));
  fact('condition number', number(material.identifiability.condition));
  fact('crownfit', provenance.crownfit);
  fact('seed', provenance.seed);
  for (const [name, value] of Object.entries(provenance.options))
    fact(`option ${plainName(name)}`, Array.isArray(value) ? value.map(v => v.name ? `${v.name} = ${v.value}` : v).join(', ') || 'none' : value);
  for (const [name, value] of Object.entries(material.linear_scales ?? {})) {
    const stddev = material.linear_scales_stddev?.[name];
    fact(name.replace('_', ' '), number(value, 4) + (stddev ? ` ± ${number(stddev, 2)}` : ''));
  }
  for (const [name, value] of Object.entries(material.calibration ?? {})) fact(name, `moved by ${number(value.moved_stddevs, 2)} times its stated error`);
  fact('command', run.command_line);
  fact('finished', run.finished_utc);
  fact('time and memory', `${number(run.wall_s)} s, at most ${number(run.peak_memory_MiB)} MiB, on ${run.host} (${run.instruction_set}), threads ${run.threads || 'all'}`);
  section('provenance', 'Provenance', facts, make('details', {}, make('summary', {}, 'Inputs, SHA-256'),
      table(['file', 'SHA-256'], Object.entries(provenance.inputs_sha256).map(([file, digest]) => row([file, make('td', {}, make('code', {}, digest))])))));
}

showVerdict();
showPhotographs();
showMeasurements();
showParameters();
showSpectra();
showCorrelation();
showProfiles();
showElsewhere();
showConvergence();
showProvenance();
paint();
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', paint);
const printing = is => () => {
  document.documentElement.classList.toggle('printing', is);
  paint();
};
addEventListener('beforeprint', printing(true));
addEventListener('afterprint', printing(false));
