// Starts a viewer in each `.srrf-view` of the page when it comes near the screen.

import style from './style.css';
import { Viewer } from './viewer.js';

function start(root) {
  const holder = root.querySelector('script[type="application/json"]');
  if (!holder) return;
  let data;
  try {
    data = JSON.parse(holder.textContent);
  } catch {
    root.textContent = 'The data of this view are damaged: the file may be cut short.';
    return;
  }
  root.srrfView = new Viewer(root, data);
}

function startAll() {
  document.head.append(Object.assign(document.createElement('style'), { textContent: style }));
  const seen = new IntersectionObserver((entries) => {
    for (const { isIntersecting, target } of entries) {
      if (!isIntersecting) continue;
      seen.unobserve(target);
      start(target);
    }
  }, { rootMargin: '400px' });
  for (const root of document.querySelectorAll('.srrf-view')) seen.observe(root);
}

if (document.readyState === 'loading') document.addEventListener('DOMContentLoaded', startAll);
else startAll();
