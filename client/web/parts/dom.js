// @ts-check
// Elements in one expression. Texts become text nodes: nothing of what a server says is read as HTML.

/**
 * @param {string} tag
 * @param {Record<string, any>} [settings] properties; those with a dash and `role`, `for`, `list` are attributes
 * @param {...(string | Node | null | undefined | false)} children
 * @returns {any}
 */
export function h(tag, settings, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(settings ?? {})) {
    if (value === undefined || value === null) continue;
    if (name === "class") made.className = value;
    else if (name.includes("-") || name === "role" || name === "for" || name === "list" || name === "scope") {
      made.setAttribute(name, String(value));
    } else if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else /** @type {any} */ (made)[name] = value;
  }
  made.append(.../** @type {(string | Node)[]} */ (children.filter((c) => c !== null && c !== undefined && c !== false)));
  return made;
}

/**
 * A field with its name above it.
 * @param {string} name @param {HTMLElement} field
 */
export function named(name, field) {
  return h("label", { class: "field" }, h("span", {}, name), field);
}

/**
 * @param {string[][]} choices value and text
 * @param {string} chosen @param {(value: string) => void} take
 */
export function picker(choices, chosen, take) {
  const select = h("select", { onchange: () => take(select.value) },
    ...choices.map(([value, text]) => h("option", { value }, text)));
  select.value = chosen;
  return select;
}

/** @param {string} name @param {boolean} checked @param {(checked: boolean) => void} take */
export function tick(name, checked, take) {
  const box = h("input", { type: "checkbox", checked, onchange: () => take(box.checked) });
  return h("label", { class: "tick" }, box, name);
}

/** A text that people copy. @param {string} name @param {string} text */
export function copied(name, text) {
  const said = h("span", { role: "status", class: "weak" });
  const copy = h("button", { type: "button", "aria-label": `Copy ${name}`, onclick: async () => {
    try {
      await navigator.clipboard.writeText(text);
      said.textContent = "copied";
    } catch {
      said.textContent = "mark it and copy it by hand";
    }
  } }, "Copy");
  return h("div", { class: "copied" }, h("code", { tabIndex: 0 }, text), copy, said);
}

const kTakesFocus = "a[href], button, input, select, summary, [tabindex]";

/**
 * Changes what is in an element: who is at one of its controls goes on at the one that stands there then.
 * @param {HTMLElement} element @param {() => void} change
 */
export function keep_focus(element, change) {
  const place = [...element.querySelectorAll(kTakesFocus)].indexOf(/** @type {Element} */ (document.activeElement));
  change();
  if (place < 0 || element.contains(document.activeElement)) return;
  const there = /** @type {NodeListOf<HTMLElement>} */ (element.querySelectorAll(kTakesFocus));
  there[Math.min(place, there.length - 1)]?.focus({ preventScroll: true });
}

/** Saves a text as a file of this machine. @param {string} name @param {string} type @param {string} text */
export const save = (name, type, text) => save_file(name, new Blob([text], { type: `${type};charset=utf-8` }));

/** @param {string} name @param {Blob} file */
export function save_file(name, file) {
  const address = URL.createObjectURL(file);
  const link = h("a", { href: address, download: name });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
}
