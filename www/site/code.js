/** A button on each sample of code that copies it. */

for (const figure of document.querySelectorAll('.code')) {
  const code = figure.querySelector('code');
  if (!code) continue;
  const button = document.createElement('button');
  button.type = 'button';
  button.className = 'button';
  const name = code.dataset['sample'] ?? 'the code';
  button.textContent = 'Copy';
  button.setAttribute('aria-label', `Copy ${name}`);
  button.addEventListener('click', async () => {
    try {
      await navigator.clipboard.writeText(code.textContent ?? '');
      button.textContent = 'Copied';
    } catch {
      // Browsers may forbid it: selected, the keyboard copies it.
      getSelection()?.selectAllChildren(code);
      button.textContent = 'Selected';
    }
  });
  figure.append(button);
}
