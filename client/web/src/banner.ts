// What is not as it should be, in words, over the picture: lost connections with the time to the next attempt, errors with a button to try again.
import { element, onClick, setText } from './dom';
import type { Live } from './live';
import type { Store } from './store';

interface Said {
  text: string;
  kind: 'bad' | 'warn' | 'good';
  retry: boolean;
}

const kResumedMs = 4000;

function said(live: Readonly<Live>, secondsLeft: number): Said | null {
  if (live.trouble !== null) return { text: live.trouble, kind: 'bad', retry: true };
  const { connection } = live;
  if (connection.state === 'waiting') {
    const when = secondsLeft > 0 ? `Connecting again in ${secondsLeft} s` : 'Connecting again';
    return { text: `Connection lost: ${connection.reason.replace(/\.$/, '')}. ${when} (attempt ${connection.attempt}). What has come stays.`, kind: 'warn', retry: false };
  }
  if (connection.state === 'connecting' && live.progress) return { text: 'Connecting again…', kind: 'warn', retry: false };
  if (live.notice !== null) return { text: live.notice, kind: 'good', retry: false };
  return null;
}

export function watchBanner(live: Store<Live>, retry: () => void): void {
  let due = 0; // when the next attempt is made
  let ticker = 0;
  let wasLost = false;
  let last = live.value.connection;
  let dismissed = '';
  const show = () => {
    const now = said(live.value, Math.ceil((due - performance.now()) / 1000));
    element('banner').hidden = !now || now.text === dismissed;
    if (!now) return;
    element('banner').className = now.kind;
    element('banner-text').setAttribute('aria-live', now.kind === 'bad' ? 'assertive' : 'polite');
    setText(element('banner-text'), now.text);
    element('retry').hidden = !now.retry;
  };
  live.watch(['connection', 'trouble', 'notice', 'progress'], ({ connection }) => {
    if (connection.state === 'waiting') {
      if (connection !== last) due = performance.now() + connection.seconds * 1000;
      wasLost = true;
      if (ticker === 0) ticker = window.setInterval(show, 250);
    } else {
      window.clearInterval(ticker);
      ticker = 0;
    }
    last = connection;
    show();
  });
  live.watch(['opened'], ({ opened }) => {
    if (!wasLost) return;
    wasLost = false;
    const notice = opened.resumed ? 'Connected again: the stream goes on where it was.' : 'Connected again: the stream begins anew.';
    live.set({ notice });
    window.setTimeout(() => live.value.notice === notice && live.set({ notice: null }), kResumedMs);
  });
  onClick('retry', retry);
  onClick('dismiss', () => {
    dismissed = element('banner-text').textContent ?? '';
    if (live.value.notice !== null) live.set({ notice: null });
    show();
  });
}
