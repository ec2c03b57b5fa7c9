// The page's settings in its address, so that a link restores them.

export type Settings = Record<string, string>;

export function readLink(): Settings {
  return Object.fromEntries(new URLSearchParams(location.hash.replace(/^#/, "")));
}

let waiting = 0;

/** Put settings into the address, at most a few times a second. */
export function writeLink(settings: () => Settings): void {
  window.clearTimeout(waiting);
  waiting = window.setTimeout(() => {
    history.replaceState(null, "", `#${new URLSearchParams(settings())}`);
  }, 150);
}

export async function copyLink(): Promise<boolean> {
  try {
    await navigator.clipboard.writeText(location.href);
    return true;
  } catch {
    return false;
  }
}
