// The banner over the picture: lost connections with the time to the next attempt, errors with a button to try again,
// and notices.
import { element, onClick, setText } from './dom';
import type { Status } from './status';
import type { Store } from './store';

interface Message {
  text: string;
  kind: 'bad' | 'warn' | 'good';
  retry: boolean; // with a button to try again
}

const kResumedMs = 4000; // how long the notice of a reconnection is shown

function messageOf(status: Readonly<Status>, secondsLeft: number): Message | null {
  if (status.error !== null) return { text: status.error, kind: 'bad', retry: true };
  const { connection } = status;
  if (connection.state === 'waiting') {
    const reason = connection.reason.replace(/\.$/, '');
    const when = secondsLeft > 0 ? `Reconnecting in ${secondsLeft} s` : 'Reconnecting';
    const text = `Connection lost: ${reason}. ${when} (attempt ${connection.attempt}). The mesh received so far is kept.`;
    return { text, kind: 'warn', retry: false };
  }
  if (connection.state === 'connecting' && status.progress) return { text: 'Reconnecting…', kind: 'warn', retry: false };
  if (status.notice !== null) return { text: status.notice, kind: 'good', retry: false };
  return null;
}

// retry: what the button does.
export function watchBanner(status: Store<Status>, retry: () => void): void {
  let due = 0; // of the next attempt, performance.now()
  let countdown = 0; // timer
  let wasLost = false;
  let last = status.value.connection;
  let topic: string | null = null; // of the message
  let dismissed: string | null = null; // the topic that the user does not want to see; until the next one
  const show = () => {
    const message = messageOf(status.value, Math.ceil((due - performance.now()) / 1000));
    topic = message && (message.kind === 'warn' ? 'connection' : message.text); // the text has a countdown
    if (topic !== dismissed) dismissed = null;
    element('banner').hidden = !message || dismissed !== null;
    if (!message) return;
    element('banner').className = message.kind;
    element('banner-text').setAttribute('aria-live', message.kind === 'bad' ? 'assertive' : 'polite');
    setText(element('banner-text'), message.text);
    element('retry').hidden = !message.retry;
  };
  status.watch(['connection', 'error', 'notice', 'progress'], ({ connection }) => {
    if (connection.state === 'waiting') {
      if (connection !== last) due = performance.now() + connection.seconds * 1000;
      wasLost = true;
      if (countdown === 0) countdown = window.setInterval(show, 250);
    } else {
      window.clearInterval(countdown);
      countdown = 0;
    }
    last = connection;
    show();
  });
  status.watch(['opened'], ({ opened }) => {
    if (!wasLost) return;
    wasLost = false;
    const notice = opened.resumed ? 'Reconnected: the stream was resumed.' : 'Reconnected: the stream was restarted.';
    status.set({ notice });
    window.setTimeout(() => status.value.notice === notice && status.set({ notice: null }), kResumedMs);
  });
  onClick('retry', retry);
  onClick('dismiss', () => {
    dismissed = topic;
    if (status.value.notice !== null) status.set({ notice: null });
    show();
  });
}
