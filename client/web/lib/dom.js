// Creates elements. Texts become text nodes, so text from a server is never parsed as HTML.

const attributes = ["role", "for", "list", "scope"];

/**
 * Creates an element "TAG.CLASS...". The optional settings are properties; settings whose names
 * start with "on" are listeners; those with a dash or in `attributes` are attributes. Children that
 * are null, undefined or false are omitted.
 */
export function h(selector, ...given) {
  const [tag, ...classes] = selector.split(".");
  const hasSettings = given[0]?.constructor === Object;
  const [settings, ...children] = hasSettings ? given : [{}, ...given];
  const element = document.createElement(tag);
  if (classes.length > 0) element.className = classes.join(" ");
  for (const [name, value] of Object.entries(settings)) {
    if (value === undefined || value === null) continue;
    if (name === "class") element.className = value;
    else if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name.includes("-") || attributes.includes(name)) element.setAttribute(name, value);
    else element[name] = value;
  }
  element.append(...children.filter(isShown));
  return element;
}

const isShown = (child) => child !== null && child !== undefined && child !== false;

/** Creates a line for messages. Returns {element, say}; `say` shows a message. */
export function statusLine() {
  const element = h("p.said", { role: "status" });
  const say = (text, isBad = false) => {
    element.textContent = text;
    element.classList.toggle("bad", isBad);
  };
  return { element, say };
}

/** Creates a field with a label above it; `help` is its tooltip. */
export const labelled = (name, field, help) =>
  h("label.field", { title: help }, h("span", name), field);

export const button = (text, onclick, settings = {}) =>
  h("button", { type: "button", onclick, ...settings }, text);

/** Creates a list to pick from. Choices are [value, text, optional group] or plain values. */
export function picker(choices, chosen, pick) {
  const select = h("select", { onchange: () => pick(select.value) });
  let parent = select;
  for (const choice of choices) {
    const [value, text = value, group = ""] = [choice].flat();
    if (group !== (parent.label ?? "")) {
      parent = group ? h("optgroup", { label: group }) : select;
      if (group) select.append(parent);
    }
    parent.append(h("option", { value }, text));
  }
  select.value = chosen;
  return select;
}

export function checkbox(name, checked, toggle) {
  const box = h("input", { type: "checkbox", checked, onchange: () => toggle(box.checked) });
  return h("label.tick", box, name);
}

export function copyButton(label, text, settings = {}) {
  const copy = async (event) => {
    const done = navigator.clipboard?.writeText(text());
    event.target.textContent = await Promise.resolve(done ?? Promise.reject()).then(
      () => "Copied",
      () => "Copying failed: copy it by hand",
    );
  };
  return button(label, copy, settings);
}

/** Creates a command line with a copy button, whose label contains `name` ("the row"). */
export const command = (name, text) =>
  h(
    "div.copied",
    h("code", { tabIndex: 0 }, text),
    copyButton("Copy", () => text, { "aria-label": `Copy the command of ${name}` }),
  );

const focusable = "a[href], button, input, select, [tabindex]";
const containers = ["THEAD", "TBODY", "TR"];
// isEqualNode() compares attributes, not the value of an input or the pixels of a canvas.
const withState = "input, select, canvas";

/**
 * Replaces the children of an element but keeps equal ones, so that a button is not replaced while
 * it is pressed. If the focused control is replaced, the control at the same position gets the
 * focus.
 */
export function setChildren(element, ...children) {
  const place = [...element.querySelectorAll(focusable)].indexOf(document.activeElement);
  replaceChanged(
    element,
    children.filter(isShown).map((one) => (typeof one === "string" ? new Text(one) : one)),
  );
  if (place < 0 || element.contains(document.activeElement)) return;
  const controls = element.querySelectorAll(focusable);
  controls[Math.min(place, controls.length - 1)]?.focus({ preventScroll: true });
}

function replaceChanged(element, children) {
  children.forEach((child, i) => {
    const old = element.childNodes[i];
    if (!old) {
      element.append(child);
    } else if (old.nodeName === child.nodeName && containers.includes(child.nodeName)) {
      for (const { name, value } of child.attributes) old.setAttribute(name, value);
      replaceChanged(old, [...child.childNodes]);
    } else if (!old.isEqualNode(child) || child.querySelector?.(withState)) {
      old.replaceWith(child);
    }
  });
  while (element.childNodes.length > children.length) element.lastChild.remove();
}

export function saveFile(name, content, type = "text/csv;charset=utf-8") {
  const address = URL.createObjectURL(
    content instanceof Blob ? content : new Blob([content], { type }),
  );
  h("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
}
