<?php
/**
 * Plugin Name: Relightable photographs
 * Description: [relightable_photo src="…" alt="…" light="torch"], and uploads of .ltm files.
 * Requires at least: 6.5
 */

defined( 'ABSPATH' ) || exit;

add_filter( 'upload_mimes', function ( $types ) {
	$types['ltm'] = 'application/vnd.ltm';
	return $types;
} );

// The package's dist folder is next to this file.
add_action( 'init', function () {
	wp_register_script_module(
		'relightable-photo',
		plugins_url( 'dist/relightable-photo.js', __FILE__ )
	);
} );

add_shortcode( 'relightable_photo', function ( $given ) {
	$addresses = array( 'src', 'poster', 'light-src' );
	$values    = array(
		'alt', 'width', 'height', 'light', 'light-x', 'light-y', 'light-size', 'light-color',
		'exposure', 'white-balance', 'tone', 'zoom', 'kiosk', 'loading', 'reveal',
	);
	$switches  = array( 'controls', 'cooperative-gestures', 'autoplay-light' );

	$given = array_merge( array( 'controls' => '1', 'cooperative-gestures' => '1' ), (array) $given );
	$html  = '<relightable-photo';
	foreach ( $given as $name => $value ) {
		if ( in_array( $name, $addresses, true ) ) {
			$html .= " $name=\"" . esc_url( $value ) . '"';
		} elseif ( in_array( $name, $values, true ) ) {
			$html .= " $name=\"" . esc_attr( $value ) . '"';
		} elseif ( in_array( $name, $switches, true ) && '0' !== $value ) {
			$html .= " $name";
		}
	}
	wp_enqueue_script_module( 'relightable-photo' );

	// For browsers that cannot run the element.
	$image = empty( $given['poster'] ) ? '' : sprintf(
		'<img src="%s" alt="%s">',
		esc_url( $given['poster'] ),
		esc_attr( $given['alt'] ?? '' )
	);
	return $html . '>' . $image . '</relightable-photo>';
} );
