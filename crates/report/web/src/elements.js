// Elements of the page.

export const element = (id) => document.getElementById(id);

/** A new element with text and attributes. */
export function make(tag, text = '', attributes = {}) {
  const made = document.createElement(tag);
  made.textContent = text;
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  return made;
}
