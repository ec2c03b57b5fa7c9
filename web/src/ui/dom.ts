// Making and finding elements.

type Attributes = Record<string, string | number | boolean | ((event: never) => void) | undefined>;
type Child = Node | string | null | undefined;

/** An element with attributes, listeners (names that begin with "on") and children. */
export function h<Tag extends keyof HTMLElementTagNameMap>(
  tag: Tag, attributes: Attributes = {}, ...children: Child[]
): HTMLElementTagNameMap[Tag] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") element.addEventListener(name.slice(2), value as EventListener);
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false && value !== undefined) element.setAttribute(name, String(value));
  }
  element.append(...children.filter((child): child is Node | string => child !== null && child !== undefined));
  return element;
}

export function byId<Element extends HTMLElement>(id: string): Element {
  const element = document.getElementById(id);
  if (!element) throw new Error(`the page has no element ${id}`);
  return element as Element;
}

/** A part of the side panel that opens and closes. */
export function section(title: string, open: boolean, ...children: Child[]): HTMLDetailsElement {
  return h("details", { class: "section", open }, h("summary", {}, title), h("div", { class: "section-body" }, ...children));
}

/** Two columns of names and values; `set` changes the values. */
export class Facts {
  readonly element = h("dl", { class: "facts" });
  private readonly values = new Map<string, HTMLElement>();

  clear(): void {
    this.values.clear();
    this.element.replaceChildren();
  }

  set(name: string, value: string, title = ""): void {
    let cell = this.values.get(name);
    if (!cell) {
      cell = h("dd");
      this.values.set(name, cell);
      this.element.append(h("div", {}, h("dt", {}, name), cell));
    }
    if (cell.textContent !== value) cell.textContent = value;
    if (cell.title !== title) cell.title = title;
  }
}
