// Small helpers around the document and numbers.

/** An element with properties, attributes (in `attributes`) and children. */
export function make(tag, { attributes = {}, on = {}, ...properties } = {}, ...children) {
  const element = Object.assign(document.createElement(tag), properties);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  for (const [name, handler] of Object.entries(on)) element.addEventListener(name, handler);
  element.append(...children.filter((child) => child !== null && child !== undefined));
  return element;
}

let labels = 0;

/** A control with its visible label. */
export function labelled(text, control) {
  control.id ||= `sv-control-${++labels}`;
  return make('div', { className: 'sv-field' }, make('label', { htmlFor: control.id }, text), control);
}

export function select(options, chosen, choose) {
  const control = make('select', { on: { change: () => choose(Number(control.value)) } });
  options.forEach((text, value) => control.append(make('option', { value, selected: value === chosen }, text)));
  return control;
}

export function range(min, max, step, value, input) {
  // The order matters: a value is clamped to the limits at the time.
  return make('input', { type: 'range', min, max, step, value, on: { input: (e) => input(Number(e.target.value)) } });
}

export const count = (n) => n.toLocaleString('en');

/** 3 significant digits. */
export function short(x) {
  if (x === 0) return '0';
  if (Math.abs(x) >= 1e9 || Math.abs(x) < 1e-4) return x.toExponential(1);
  return Number(x.toPrecision(3)).toLocaleString('en', { maximumSignificantDigits: 3 });
}

export function withUnit(text, unit) {
  return !unit ? text : unit === '°' || unit === '%' ? text + unit : `${text} ${unit}`;
}
