/** Adds a copy button to each code sample. */

for (const figure of document.querySelectorAll('.code')) {
  const code = figure.querySelector('code');
  if (!code) continue;
  const button = document.createElement('button');
  button.type = 'button';
  button.className = 'button';
  button.textContent = 'Copy';
  button.setAttribute('aria-label', `Copy ${code.dataset['sample'] ?? 'the code'}`);
  button.addEventListener('click', async () => {
    try {
      await navigator.clipboard.writeText(code.textContent ?? '');
      button.textContent = 'Copied';
    } catch {
      // The browser may deny access to the clipboard. Select the text, so that the keyboard can copy it.
      getSelection()?.selectAllChildren(code);
      button.textContent = 'Selected';
    }
  });
  figure.append(button);
}
