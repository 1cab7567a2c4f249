import Window from '../Window';

export default function Page() {
  return <Window src="/photos/glass.ltm" />;
}
